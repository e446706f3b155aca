"""The papers' models as diagnosis cases: a rig that is one of them, a user whose model is simpler.

``python -m benchmarks.paper_cases`` prints what ``tsm-fmu diagnose`` answers and, for the loop of MSSP 2015, what the
answer does to the compensated error. Logs are made by `models/` and co-simulated FMUs, never by `effects/`.
"""
