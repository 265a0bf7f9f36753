"""``affordance watch``: shows an observer in an experiment, live in the browser."""

import argparse
import os
import socket
import sys
import webbrowser
from pathlib import Path
from urllib.parse import urlsplit

from affordance.commands import answers, options
from affordance.commands.catalogue import OF_THE_PAPER
from affordance.commands.setups import check_experiment, read_setup
from affordance.extensions.watch.show import Show


def run(arguments: argparse.Namespace) -> int:
    """Shows an observer until the user interrupts it. Returns the exit status."""
    options.check_bounds(arguments)
    check_experiment(arguments, OF_THE_PAPER)
    if arguments.robot is not None and arguments.robot.is_file():
        answers.tell(arguments, f"{arguments.robot.name}: the import takes about half a minute, unless it is cached.")
    robot = options.open_robot(arguments)
    arguments.repeats, arguments.jobs, arguments.out = 1, 1, Path("results")
    setup = read_setup(arguments, robot, options.read_changes(arguments))
    if arguments.memory:
        setup = options.remember(setup, arguments, robot)
    show = Show(arguments.experiment, setup)
    address = show.scene.page.address
    hosts = [urlsplit(each).netloc for each in show.scene.addresses]
    tunnels = " ".join(f"-L {host}:{host}" for host in hosts)
    print(f"Watch {arguments.experiment} at {address} (Ctrl-C ends it).")
    print(f"From another machine, first run\n    ssh {tunnels} {socket.gethostname()}", flush=True)
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open_new_tab(address)
    try:
        show.run()
    except KeyboardInterrupt:
        print()
    return 0
