"""Cases, steps, particles, loads and fields."""

import itertools
import os
import signal
import threading
import time

import numpy as np
import pytest
import turbid
from conftest import settling
from turbid import LOAD, PARTICLE, Simulation


def test_a_dict_a_text_and_a_file_are_the_same_case(case, tmp_path):
    simulation = Simulation(case)
    simulation.step(5)
    file = tmp_path / "case.toml"
    file.write_text(simulation.toml)
    for other in [simulation.toml, file, str(file)]:
        again = Simulation(other)
        again.step(5)
        assert again.state_hash == simulation.state_hash


def test_results_do_not_depend_on_the_number_of_threads(case):
    hashes = set()
    for threads in [1, 2]:
        simulation = Simulation(case, threads=threads)
        simulation.step(10)
        hashes.add((simulation.state_hash, simulation.positions.tobytes()))
    assert len(hashes) == 1


def test_constants_of_a_case(case):
    simulation = Simulation(case)
    assert simulation.cells == (16, 16, 24)
    assert simulation.periodic == (True, True, True)
    np.testing.assert_allclose(simulation.size, [4e-3, 4e-3, 6e-3])
    np.testing.assert_allclose(simulation.gravity, [0, 0, -9.80665])
    np.testing.assert_allclose(simulation.radii, 5e-4)
    np.testing.assert_allclose(simulation.masses, 2500 * np.pi / 6 * 1e-9)
    np.testing.assert_allclose(simulation.moments, simulation.masses[:, None] * 0.4 * 25e-8 * np.ones(3))
    np.testing.assert_array_equal(simulation.frames, [[0, 0, 0, 1]] * 2)
    assert simulation.end == pytest.approx(40 * simulation.time_step)
    assert isinstance(simulation.warnings, list)


def test_a_case_runs_to_its_end_or_to_a_time_and_calls_back(case):
    simulation = Simulation(case)
    simulation.run(10 * simulation.time_step)
    assert simulation.steps == 10 and simulation.time == pytest.approx(10 * simulation.time_step)
    seen = []
    simulation.run(callback=lambda s: seen.append(s.steps), every=8)
    assert seen == [18, 26, 34, 40]
    simulation = Simulation(case)
    simulation.run(callback=lambda s: s.steps < 7, every=2)
    assert simulation.steps == 8
    with pytest.raises(ValueError, match="every: expected at least 1"):
        simulation.run(every=0)


def test_particles_are_arrays_that_may_be_changed_and_set(case):
    simulation = Simulation(case)
    states = simulation.particles
    assert states.dtype == PARTICLE and states.shape == (2,)
    np.testing.assert_array_equal(states.id, [0, 1])
    states.velocity[1] = [1e-3, 0, 0]
    states.position[0, 0] += 4e-3
    simulation.particles = states
    np.testing.assert_array_equal(simulation.velocities, [[0, 0, 0], [1e-3, 0, 0]])
    np.testing.assert_allclose(simulation.positions[0], [2e-3, 2e-3, 4e-3])
    simulation.angular_velocities = np.full((2, 3), 0.5)
    expected = simulation.moments * 0.5
    np.testing.assert_allclose(simulation.particles.angular_momentum, expected)
    simulation.orientations = [[0.0, 0.6, 0.0, 0.8]] * 2
    np.testing.assert_allclose(simulation.orientations[1], [0, 0.6, 0, 0.8])


def test_what_is_set_is_checked_and_the_message_says_what_was_expected(case):
    simulation = Simulation(case)
    wrong = [
        (np.zeros((2, 3), dtype=np.float32), "position: expected an array of float64 of shape (2, 3) in C order, got float32"),
        (np.zeros((2, 3), dtype=int), "got int64 of shape (2, 3)"),
        (np.zeros((3, 2)), "got float64 of shape (3, 2)"),
        (np.zeros((3, 2)).T, "in Fortran order"),
        (np.zeros(6), "of shape (6,)"),
    ]
    for value, message in wrong:
        with pytest.raises(ValueError) as error:
            simulation.positions = value
        assert message in str(error.value)
    for states in [simulation.particles[:1], np.zeros(2), np.zeros((2, 3))]:
        with pytest.raises(ValueError, match="particles: expected an array of id kind position"):
            simulation.particles = states
    with pytest.raises(turbid.Error, match="the ids must ascend, but 0 follows 1"):
        simulation.particles = simulation.particles[::-1].copy()
    with pytest.raises(turbid.Error, match="the velocity of particle 0 is not finite"):
        simulation.velocities = np.full((2, 3), np.nan)


def test_fields_have_the_shape_of_the_box_and_the_order_of_its_axes(case):
    simulation = Simulation(case)
    simulation.step(10)
    fields = simulation.fields()
    assert fields.velocity.shape == (16, 16, 24, 3) and fields.velocity.dtype == np.float32
    assert fields.pressure.shape == fields.solid_fraction.shape == (16, 16, 24)
    for x, y, z in simulation.positions:
        assert fields.solid_fraction[int(x / simulation.dx), int(y / simulation.dx), int(z / simulation.dx)] == 1
    assert fields.solid_fraction[0, 0, 20] == 0
    flow, fraction = simulation.mean_flow()
    np.testing.assert_allclose(fields.solid_fraction.mean(), fraction, rtol=1e-3)
    assert flow.shape == (3,)
    centre = simulation.positions[0]
    i, j, k = (centre / simulation.dx).astype(int)
    np.testing.assert_allclose(fields.velocity[i, j, k], simulation.velocities[0], atol=2e-3)


def test_a_case_without_fluid_has_no_fields_and_no_loads():
    case = settling()
    del case["fluid"], case["lattice"]
    case["dry"] = {"time_step": 1e-5}
    simulation = Simulation(case)
    simulation.step(10)
    np.testing.assert_allclose(simulation.velocities[:, 2], -9.80665e-4, rtol=1e-9)
    np.testing.assert_array_equal(simulation.loads.force, 0)
    with pytest.raises(ValueError, match="no fluid"):
        simulation.fields()


def test_loads_are_drag_and_buoyancy(case):
    simulation = Simulation(case)
    assert not simulation.loads.force.any()
    simulation.step(20)
    loads = simulation.loads
    assert loads.dtype == LOAD and loads.shape == (2,)
    buoyancy = 1000 * simulation.volumes * 9.80665
    assert (loads.force[:, 2] > buoyancy).all() and (loads.force[:, 2] < 2.5 * buoyancy).all()


def test_external_loads_are_arrays_or_functions_of_time_and_particles(case):
    simulation = Simulation(case)
    bearing = np.zeros((2, 3))
    bearing[:, 2] = 1500 * simulation.volumes * 9.80665
    simulation.set_external_load(bearing)
    simulation.step(10)
    assert abs(simulation.velocities).max() < 1e-3
    simulation.set_external_load(None)
    simulation.step(5)
    assert (simulation.velocities[:, 2] < -1e-3).all()

    times = []

    def pull(time, particles):
        times.append(time)
        return np.outer(particles.id, [1e-6, 0, 0])

    simulation = Simulation(case)
    simulation.set_external_load(pull)
    simulation.step(3)
    assert times == [0, simulation.time_step, 2 * simulation.time_step]
    assert simulation.velocities[1, 0] > 1e-6 and abs(simulation.velocities[0, 0]) < 1e-6

    torque = np.zeros(2, dtype=LOAD)
    torque["torque"][:, 1] = 1e-9
    simulation = Simulation(case)
    simulation.set_external_load(torque)
    simulation.step(3)
    assert (simulation.angular_velocities[:, 1] > 0).all()
    with pytest.raises(ValueError, match=r"external load: expected an array of float64 of shape \(2, 3\)"):
        simulation.set_external_load(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="the caller moves the particles"):
        Simulation(case, engine="caller").set_external_load(bearing)


def test_an_exception_of_a_callback_comes_through(case):
    simulation = Simulation(case)

    def broken(time, particles):
        raise KeyError("mine")

    simulation.set_external_load(broken)
    with pytest.raises(KeyError, match="mine"):
        simulation.step()
    simulation.set_external_load(None)
    simulation.step()


def test_an_engine_in_python_settles_as_the_native_one_does(case):
    native = Simulation(case)
    native.step(60)

    def free(particles, loads, dt):
        particles.velocity += dt * (loads.force / driven.masses[:, None] + driven.gravity)
        particles.position += dt * particles.velocity

    driven = Simulation(case, engine=free)
    driven.step(60)
    np.testing.assert_allclose(driven.velocities[:, 2], native.velocities[:, 2], rtol=0.01)

    manual = Simulation(case, engine="caller")
    states = manual.particles
    for _ in range(60):
        manual.step()
        free(states, manual.loads, manual.time_step)
        manual.particles = states
    assert manual.state_hash == driven.state_hash
    with pytest.raises(ValueError, match='engine: expected None, "caller" or a function'):
        Simulation(case, engine="native")


def slow_fall(case, interrupt=lambda call: None):
    """A simulation with an engine that takes a millisecond and calls ``interrupt`` with the number of its calls."""
    calls = itertools.count(1)

    def fall(particles, loads, dt):
        particles.velocity[:, 2] -= dt
        particles.position += dt * particles.velocity
        time.sleep(1e-3)
        interrupt(next(calls))

    return Simulation(case, engine=fall)


def test_signals_leave_no_step_without_the_move_of_the_engine(case):
    class Interrupt(Exception):
        pass

    def handler(number, frame):
        raise Interrupt

    whole = slow_fall(case)
    whole.step(60)
    simulation = slow_fall(case)
    interrupts = 0
    previous = signal.signal(signal.SIGALRM, handler)
    try:
        while simulation.steps < 60:
            try:
                signal.setitimer(signal.ITIMER_REAL, 1e-3 * (interrupts % 30 + 1))
                simulation.run(60 * simulation.time_step)
                signal.setitimer(signal.ITIMER_REAL, 0)
            except Interrupt:
                interrupts += 1
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    simulation.step(0)
    assert interrupts > 0 and simulation.steps == 60
    assert simulation.state_hash == whole.state_hash


def test_a_signal_between_the_fluid_and_the_engine_waits_for_the_engine(case):
    class Interrupted:
        """A session whose third step a signal ends."""

        def __init__(self, session):
            self.session = session

        def __getattr__(self, name):
            return getattr(self.session, name)

        def advance(self, count):
            self.session.advance(count)
            if self.session.steps() == 3:
                raise KeyboardInterrupt

    simulation, whole = slow_fall(case), slow_fall(case)
    simulation._session = Interrupted(simulation._session)
    with pytest.raises(KeyboardInterrupt):
        simulation.step(10)
    whole.step(3)
    assert simulation.steps == 3 and simulation.state_hash == whole.state_hash


@pytest.mark.parametrize("work", ["step", "run"])
def test_a_step_in_which_the_engine_raised_is_completed_by_the_next_call(case, work):
    def interrupt(call):
        if call == 3:
            raise KeyError("mine")

    whole = slow_fall(case)
    whole.step(3)
    simulation = slow_fall(case, interrupt)
    with pytest.raises(KeyError, match="mine"):
        simulation.step(3)
    assert simulation.steps == 3 and simulation.state_hash != whole.state_hash
    simulation.step(0) if work == "step" else simulation.run(3 * simulation.time_step)
    assert simulation.steps == 3 and simulation.state_hash == whole.state_hash

    simulation = slow_fall(case, interrupt)
    with pytest.raises(KeyError, match="mine"):
        simulation.step(3)
    simulation.particles = whole.particles
    simulation.step(0)
    assert simulation.state_hash == whole.state_hash


def test_a_dict_may_have_paths_and_numbers_and_arrays_of_numpy(case, tmp_path):
    case["output"] = {"directory": str(tmp_path)}
    expected = Simulation(case).toml
    case["output"] = {"directory": tmp_path}
    case["domain"]["size"] = np.array(case["domain"]["size"])
    case["run"] = {"end": {"steps": np.int64(40)}, "threads": np.int32(1)}
    assert Simulation(case).toml == expected
    case["output"]["directory"] = {1, 2}
    with pytest.raises(ValueError, match="case: expected dicts, lists, texts, numbers, paths and arrays of numpy, got set"):
        Simulation(case)


def test_errors_of_a_case_have_key_problem_remedy_and_code(case, tmp_path):
    case["lattice"]["relaxation_time"] = 0.4
    with pytest.raises(turbid.Error) as error:
        Simulation(case)
    assert error.value.key == "lattice.relaxation_time" and error.value.code == 2
    assert "must be a finite number above 0.5" in error.value.what and error.value.remedy
    Simulation(case, options=["lattice.relaxation_time=0.6"])
    with pytest.raises(turbid.Error, match="nowhere.toml") as error:
        Simulation(tmp_path / "nowhere.toml")
    assert error.value.key == "" and error.value.code == 2
    for value, message in [(3, "case: expected a path"), ({"domain": None}, "case: "), ({"a": float("nan")}, "JSON")]:
        with pytest.raises(ValueError, match=message):
            Simulation(value)


def test_a_simulation_that_diverges_is_an_error_at_once_and_for_ever(case):
    simulation = Simulation(case)
    simulation.step(3)
    simulation.set_external_load(np.full((2, 3), 1.0))
    for _ in range(3):
        with pytest.raises(turbid.Error, match="diverged at step 3: ") as error:
            simulation.step()
        assert error.value.code == 3
    with pytest.raises(turbid.Error, match="diverged at step 3: "):
        simulation.run()
    assert simulation.steps == 4 and np.isfinite(simulation.positions).all()


def test_an_engine_is_not_called_again_for_a_step_that_has_failed(case):
    calls = []

    def too_fast_for_the_fluid(particles, loads, dt):
        calls.append(dt)
        particles.velocity[0, 0] = 0.9 * simulation.dx / dt

    simulation = Simulation(case, engine=too_fast_for_the_fluid)
    with pytest.raises(turbid.Error, match="fluid velocity"):
        simulation.step(30)
    count = len(calls)
    with pytest.raises(turbid.Error, match="fluid velocity"):
        simulation.step()
    assert 0 < count == len(calls) < 20


@pytest.mark.parametrize("work", ["step", "run"])
def test_ctrl_c_ends_stepping_and_the_simulation_can_go_on(case, work):
    simulation = Simulation(case)
    simulation.step()
    # A shell has those that it starts in the background ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        timer.start()
        simulation.step(10**9) if work == "step" else simulation.run(1e6)
    assert time.monotonic() - begin < 20
    steps = simulation.steps
    simulation.step()
    assert 0 < steps == simulation.steps - 1


@pytest.mark.parametrize("of", ["engine", "load", "run"])
def test_steps_of_two_threads_are_made_one_after_the_other(case, of):
    def fall(particles, loads, dt):
        particles.velocity[:, 2] -= 1e-5
        particles.position += dt * particles.velocity
        time.sleep(1e-4)

    def pull(at, particles):
        time.sleep(1e-4)
        return np.outer(particles.id + 1, [1e-7 * (1 + at), 0, 0])

    def opened():
        simulation = Simulation(case, threads=1, engine=fall if of == "engine" else None)
        if of != "engine":
            simulation.set_external_load(pull)
        return simulation

    def work():
        if of == "run":
            shared.run(40 * shared.time_step)
        else:
            for _ in range(20):
                shared.step()

    alone, shared = opened(), opened()
    alone.step(40)
    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert shared.steps == 40 and shared.state_hash == alone.state_hash


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_simulation_of_the_parent_is_an_error_in_a_forked_process(case):
    simulation = Simulation(case)
    simulation.step()
    calls = [simulation.step, simulation.run, simulation.fields, lambda: simulation.particles, lambda: simulation.time]
    # As held by a thread that the child does not have.
    holder = threading.Thread(target=simulation._lock.acquire)
    holder.start()
    holder.join()
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        told = 0
        for call in calls:
            try:
                call()
            except turbid.Error as error:
                told += error.code == 2 and "is a fork" in str(error)
        del call, calls, simulation
        os._exit(0 if told == 5 else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_times_that_no_run_reaches_and_negative_numbers_of_steps_are_refused(case):
    simulation = Simulation(case)
    for until in [1e300, float("inf"), float("nan")]:
        with pytest.raises(turbid.Error, match="steps of .* s are possible"):
            simulation.run(until)
    with pytest.raises(ValueError, match="expected at least 0 steps, got -1"):
        simulation.step(-1)


def test_bodies_in_each_other_and_jumps_through_the_box_are_refused(case):
    simulation = Simulation(case, engine="caller")
    states = simulation.particles
    with pytest.raises(turbid.Error, match="particle 0 would overlap particle 1"):
        simulation.positions = states.position[[0, 0]]
    simulation.step()
    with pytest.raises(turbid.Error, match="cells from where it was before the last step"):
        simulation.positions = states.position + 1e-3
    with pytest.raises(turbid.Error, match="too far to be wrapped"):
        simulation.positions = states.position + 1e300
    simulation.positions = states.position + 1e-5


@pytest.mark.parametrize("name", ["steps", "time", "particles", "loads", "state_hash"])
def test_what_is_read_of_the_state_waits_for_a_step_of_another_thread(name):
    assert hasattr(getattr(Simulation, name).fget, "__wrapped__")


def test_other_threads_of_python_run_while_a_simulation_steps(case):
    simulation = Simulation(case)
    stepping = threading.Thread(target=simulation.step, args=(200,))
    stepping.start()
    counts = 0
    while stepping.is_alive():
        counts += 1
        time.sleep(1e-4)
    assert counts > 10


def test_the_example_of_the_docstring_works():
    import doctest

    assert doctest.testmod(turbid.simulation).failed == 0
