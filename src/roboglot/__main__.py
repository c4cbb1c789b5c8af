"""``python -m roboglot``, and the command ``roboglot``: Ctrl-C ends it without a word also while modules are loaded."""

import signal


def run() -> None:
    """Load the command line and run it. SIGINT has Python's own meaning again when it is loaded."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from roboglot.cli import run_process

    signal.signal(signal.SIGINT, before)
    run_process()


if __name__ == "__main__":
    run()
