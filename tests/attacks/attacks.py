"""What is tried: values of arguments, and what is done to a call as a whole.

An attack's name ends with "[KIND] what"; `prepare` changes the lab before the call.
"""

import os
import re

INPUTS = ["campaign.yaml", "camera.yaml", "hexapod.yaml", "targets.csv", "legs.csv", "sheet.yaml", "markers_nominal.csv",
          "ros.yaml", "poses/home/first.jpg", "calibration/first.jpg"]


def kind_of(name):
    return re.search(r"\[(.*?)\]", name).group(1)


def input_values():
    """Names of the campaign's own files, straight and by detours: as an output they must not be overwritten."""
    for name in INPUTS:
        yield name, name, None
        yield f"./out/../{name}", f"./out/../{name}", None
        ending = os.path.splitext(name)[1]
        for how, make in (("link", os.symlink), ("hard link", os.link)):
            def prepare(lab, name=name, make=make, ending=ending):
                make(lab / name, lab / ("link" + ending))
            yield f"{how} to {name}", "link" + ending, prepare


def values():
    for name, value, prepare in input_values():
        yield f"[input] {name}", value, prepare


def of_call(call):
    """Streams that are closed before the program starts: no file may take their place."""
    for closed in ((0,), (1,), (2,), (0, 1, 2)):
        def close(closed=closed):
            for stream in closed:
                os.close(stream)
        yield f"[streams] {closed} closed", call, None, {"preexec_fn": close}
