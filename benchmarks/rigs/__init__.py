"""The diagnosis on rigs drawn afresh: ours (`benchmarks.blind`) and another author's, one table for both.

A seed that was looked at is burnt: rules made after looking fit it. So each call draws a new seed, and prints it with
the commit that was judged.
"""
