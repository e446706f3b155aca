from .cli import main

if __name__ == "__main__":  # not in the processes that a verb starts, which load this file too
    main()
