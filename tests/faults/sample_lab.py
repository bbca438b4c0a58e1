"""What the scripts that torture hexcal share: their first arguments and a copy of a campaign's files."""

import argparse
import pathlib
import shutil


def argument_parser(description):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hexcal", required=True, type=pathlib.Path)
    parser.add_argument("--campaign", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    return parser


def copy_without_photographs(campaign, folder, number):
    """Copies the campaign's files to folder/lab; returns that and the ids of home and so many other poses."""
    lab = pathlib.Path(folder) / "lab"
    lab.mkdir()
    for file in campaign.iterdir():
        if file.is_file():
            shutil.copy(file, lab)
    others = sorted(p.name for p in (campaign / "poses").iterdir() if p.name != "home")
    return lab, ["home"] + others[:number]
