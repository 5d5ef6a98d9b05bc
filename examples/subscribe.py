"""Hears every estimate of every run: needs eclipse-zenoh and the standard library only."""

import json
import signal

import zenoh

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C, also while no run is there yet

config = zenoh.Config.from_json5(
    """{mode: "client", scouting: {multicast: {enabled: false}},
        connect: {endpoints: ["tcp/127.0.0.1:7447"], timeout_ms: -1,
                  retry: {period_init_ms: 100, period_max_ms: 200}}}"""
)
with zenoh.open(config) as session, session.declare_subscriber("dcpf/*/*/estimate") as subscriber:
    for sample in subscriber:
        estimate = json.loads(sample.payload.to_string())
        x, y = estimate["mean"][:2]
        who = f"{estimate['frame']:4d}  {estimate['estimator']:6s} {estimate['node']:8s}"
        print(f"{who} {x:7.3f} {y:7.3f} m", flush=True)
