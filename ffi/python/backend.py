"""Builds the Python package (PEP 517): the module by maturin, and beside it the program `turbid`, which pip then puts on PATH.

It is the program itself and not a call of the module, because it starts itself anew, and deals with signals and exit codes.
As a script it does this alone, before `maturin build`.
"""

import json
import shutil
import subprocess
from pathlib import Path

from maturin import *  # noqa: F403 - the other hooks
import maturin

HERE = Path(__file__).resolve().parent


def add_program():
    """Builds the program and puts it where maturin looks for the scripts of a package.

    With the module, as cargo would compile everything twice, with other features of a crate, if it built one after the other.
    """
    command = ["cargo", "build", "--locked", "--profile", "dist", "--package", "turbid-cli", "--package", "turbid-python",
               "--message-format", "json-render-diagnostics"]
    lines = subprocess.run(command, cwd=HERE, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    program = next(path for path in (json.loads(line).get("executable") for line in lines) if path)
    scripts = HERE / "turbid._turbid.data" / "scripts"
    scripts.mkdir(parents=True, exist_ok=True)
    shutil.copy2(program, scripts / "turbid")


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    add_program()
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    add_program()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


if __name__ == "__main__":
    add_program()
