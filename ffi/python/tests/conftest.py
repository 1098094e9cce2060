"""What the tests share."""

import pytest


def settling(**changes):
    """A sphere of 1 mm settles in a periodic box of 16 x 16 x 24 cells; ``changes`` replace sections."""
    return {
        "domain": {"size": [4e-3, 4e-3, 6e-3]},
        "fluid": {"density": 1000.0, "viscosity": 1e-5},
        "lattice": {"cells_per_diameter": 4, "relaxation_time": 0.6},
        "particles": [
            {"shape": {"sphere": {"diameter": 1e-3}}, "density": 2500.0, "list": [[2e-3, 2e-3, 4e-3], [1e-3, 3e-3, 1e-3]]}
        ],
        "run": {"end": {"steps": 40}, "threads": 1},
        **changes,
    }


@pytest.fixture
def case():
    return settling()
