"""`python -m tlpsim.scenarios.cli`, the same as `tlpsim`."""

from tlpsim.scenarios.cli.main import main

if __name__ == "__main__":
    main()
