"""Replays the references of a robot's logs over the wire, and logs as it does.

    PYTHONPATH=.:tests python -m support.record_over_wire LOG... --out DIR

Starts `affetto serve` and plays its client: the robot's initializer, then 10 s
under its PID law, of which each gives a CSV in DIR, named as the robot's log.
"""

import argparse
from pathlib import Path

import numpy as np

from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.log import read_log
from support.serving import serving
from support.wire_client import WireClient


def record(server, log, controller, joint, path):
    """Follows the reference of one joint's log; returns the client."""
    gains = [
        np.array([getattr(each, name) for each in controller.joints])
        for name in ("kP", "kD", "kI")
    ]

    def reference(t):
        q, dq = np.zeros((2, len(controller.joints)))
        q[joint] = np.interp(t, log.t, log.q_des)
        dq[joint] = np.interp(t, log.t, log.dq_des)
        return q, dq

    with WireClient(server.sensor_port, server.command_port) as client:
        client.start()
        client.initialize()
        client.track(log.t[-1], reference, gains, [joint])
        client.control(1.0, lambda t: np.zeros((client.n, 2)))
        client.write_log(path)


def main():
    """Records each log."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="+", metavar="LOG")
    parser.add_argument("--out", required=True, metavar="DIR")
    parser.add_argument("--joint", type=int, default=5)
    parser.add_argument("--scenario", default="robot")
    args = parser.parse_args()
    controller = load_robot_controller()
    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    with serving(f"--scenario={args.scenario}") as server:
        for path in args.logs:
            log = read_log(path, args.joint, controller)
            record(
                server, log, controller, args.joint, folder / Path(path).name
            )
            print(path, flush=True)
        print(server.end()[1])


if __name__ == "__main__":
    main()
