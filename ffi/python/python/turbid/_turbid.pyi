from typing import List, Optional, Tuple

__version__: str

class Error(Exception):
    """Failure of Turbid."""

    code: int
    """2: input or files; 3: the simulation diverged or an engine failed; 4: stopped before its end."""
    key: str
    """Path of the key of the case, ``"lattice.relaxation_time"``; empty where no key is meant."""
    what: str
    """Problem in one line; empty as ``key`` is."""
    remedy: str
    """Suggested change; may be empty."""

class Session:
    def __new__(
        cls,
        form: str,
        text: str,
        options: List[str],
        threads: Optional[int],
        caller_driven: bool,
        communicator: Optional[int],
    ) -> "Session": ...
    def advance(self, count: int) -> None: ...
    def check_process(self) -> None: ...
    def nearest_step(self, time: float) -> int: ...
    def check(self) -> None: ...
    def steps(self) -> int: ...
    def particles(self) -> bytearray: ...
    def set_particles(self, rows: bytes) -> None: ...
    def loads(self) -> bytearray: ...
    def set_external_loads(self, rows: bytes) -> None: ...
    def fields(self) -> List[bytearray]: ...
    def mean_flow(self) -> Tuple[List[float], float]: ...
    def state_hash(self) -> int: ...
    def kinds(self) -> List[Tuple[float, float, float, List[float], List[float]]]: ...
    time_step: float
    end_step: int
    cells: List[int]
    block: Tuple[List[int], List[int]]
    has_fluid: bool
    dx: float
    periodic: List[bool]
    gravity: List[float]
    warnings: List[str]
    toml: str

def run(form: str, text: str, options: List[str], threads: Optional[int], overwrite: bool) -> str: ...
