"""Native FMUs: a kernel's Python text translated to C99, compiled for each platform, packed with its source.

`unit` translates one kernel, with the laws that it calls, into C that can be read beside it; ``c/`` holds the FMI
layers, which know nothing of any model.
"""
