"""Simulations on a communicator of mpi4py."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import settling

import turbid

SCRIPT = Path(__file__).parent / "wandering.py"
VARIABLES = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
}


def printed(*command):
    """Lines that a command prints."""
    done = subprocess.run(command, env={**os.environ, **VARIABLES}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("ranks", [1, 3])
def test_a_dem_in_several_processes_moves_its_spheres_as_one_alone(tmp_path, ranks):
    places = [[1e-3, 1e-3, 4.01e-3], [3e-3, 3e-3, 2.01e-3], [1e-3, 3e-3, 3.1e-3], [3e-3, 1e-3, 5.3e-3]]
    kind = {"shape": {"sphere": {"diameter": 1e-3}}, "density": 2500.0, "list": places}
    case = tmp_path / "case.json"
    case.write_text(json.dumps(settling(particles=[kind])))
    alone = printed(sys.executable, str(SCRIPT), str(case), "150", "alone")
    job = printed("mpirun", "-n", str(ranks), sys.executable, str(SCRIPT), str(case), "150")
    assert job[:2] == alone[:2]
    assert int(job[2].split()[1]) >= (2 if ranks > 1 else 0)


def test_a_communicator_leaves_no_choice_of_threads_and_loads_of_the_caller_act_where_the_spheres_are(tmp_path):
    script = tmp_path / "pulled.py"
    script.write_text(
        "import json, sys\nimport numpy as np\nimport turbid\nfrom mpi4py import MPI\n"
        "comm = MPI.COMM_WORLD\ncase = json.loads(sys.argv[1])\n"
        "simulation = turbid.Simulation(case, comm=comm)\n"
        "own = simulation.particles\n"
        "force = np.zeros((len(own), 3))\nforce[:, 0] = 1e-6 * (1 + own.id)\n"
        "simulation.set_external_load(force)\nsimulation.step(8)\n"
        "rows = np.concatenate(comm.allgather(np.asarray(simulation.particles)))\n"
        "rows = rows[np.argsort(rows['id'])]\n"
        "try:\n    turbid.Simulation(case, comm=comm, threads=2)\nexcept ValueError as why:\n"
        "    refusals = comm.gather(str(why))\n"
        "if comm.rank == 0:\n    print(rows['velocity'].tolist(), *refusals, sep='\\n')\n"
    )
    said = printed("mpirun", "-n", "2", sys.executable, str(script), json.dumps(settling()))
    alone = turbid.Simulation(settling())
    alone.set_external_load([[1e-6, 0.0, 0.0], [2e-6, 0.0, 0.0]])
    alone.step(8)
    assert said == [str(alone.velocities.tolist()), *["threads: the processes of the communicator are the ranks"] * 2]
