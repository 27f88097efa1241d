"""``python -m footfall`` is ``footfall``, where that is on no path."""

from footfall.cli import main

if __name__ == "__main__":
    main()
