//! Native part of the Python package: sessions, whose particles, loads and fields are bytes that numpy views.

use bytemuck::{Pod, allocation::pod_collect_to_vec};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;
use turbid::case::{self, Origin};
use turbid::dem::{Load, LoadRow};
use turbid::particle::Particle;
use turbid::simulation::{self, RunOptions};

create_exception!(
    turbid,
    Error,
    PyException,
    "Failure of Turbid. Attributes: `code` (2 input, 3 diverged or engine failed, 4 stopped), and for an error in a case `key`, \
     the path of the key, `what`, the problem in one line, and `remedy`, a suggestion; all three empty otherwise."
);

/// Record that `turbid.simulation.PARTICLE` describes.
const _: () = assert!(size_of::<Particle>() == 192);

/// The exception for an error.
fn raise(py: Python<'_>, error: turbid::Error) -> PyErr {
    let code = error.exit_code();
    let raised = Error::new_err(error.to_string());
    let [key, what, remedy] = match error {
        turbid::Error::Case { key, what, remedy, .. } => [key, what, remedy],
        _ => Default::default(),
    };
    let value = raised.value(py);
    let set = value.setattr("code", code).and_then(|()| value.setattr("key", key));
    match set.and_then(|()| value.setattr("what", what)).and_then(|()| value.setattr("remedy", remedy)) {
        Ok(()) => raised,
        Err(other) => other,
    }
}

/// Does `work` without the lock of the interpreter.
fn without_lock<R: Send>(py: Python<'_>, work: impl FnOnce() -> turbid::Result<R> + Send) -> PyResult<R> {
    py.detach(work).map_err(|error| raise(py, error))
}

/// Does `work` with the case in `text`, which is of a `form`, the path of a file, TOML, or JSON of a dict, and its options.
fn with_case<R: Send>(
    py: Python<'_>,
    (form, text): (&str, String),
    (mut options, threads): (Vec<String>, Option<usize>),
    work: impl FnOnce(Origin, &[String]) -> turbid::Result<R> + Send,
) -> PyResult<R> {
    options.extend(threads.map(|threads| format!("run.threads={threads}")));
    let text = match form {
        "json" => {
            let table: toml::Table =
                serde_json::from_str(&text).map_err(|why| PyValueError::new_err(format!("case: {why}")))?;
            toml::to_string(&table).map_err(|why| PyValueError::new_err(format!("case: {why}")))?
        }
        _ => text,
    };
    let origin = if form == "path" { Origin::File(Path::new(&text)) } else { Origin::Text(&text, "case") };
    without_lock(py, || work(origin, &options))
}

/// Rows of a list as bytes.
fn bytes<'py, T: Pod>(py: Python<'py>, rows: &[T]) -> Bound<'py, PyByteArray> {
    PyByteArray::new(py, bytemuck::cast_slice(rows))
}

/// A row of each load: force (N), torque (N m).
fn loads_of(rows: &[u8]) -> Vec<Load> {
    let rows: Vec<LoadRow> = pod_collect_to_vec(rows);
    rows.into_iter().map(Load::from).collect()
}

/// A simulation on threads of its own, or on the processes of a communicator with a handle of Fortran's.
#[pyclass(frozen, module = "turbid._turbid")]
struct Session(simulation::Session);

#[pymethods]
impl Session {
    #[new]
    fn new(
        py: Python<'_>,
        form: &str,
        text: String,
        options: Vec<String>,
        threads: Option<usize>,
        caller_driven: bool,
        communicator: Option<i32>,
    ) -> PyResult<Self> {
        with_case(py, (form, text), (options, threads), |origin, options| match communicator {
            Some(handle) => simulation::Session::on_communicator(origin, options, handle, caller_driven),
            None if caller_driven => simulation::Session::caller_driven(case::read_alone(origin, options)?),
            None => simulation::Session::new(case::read_alone(origin, options)?),
        })
        .map(Self)
    }

    /// Advances by steps; handlers of signals run between them.
    fn advance(&self, py: Python<'_>, count: u64) -> PyResult<()> {
        (0..count).try_for_each(|_| {
            without_lock(py, || self.0.advance(1))?;
            py.check_signals()
        })
    }

    /// Checks that the threads of the session are in this process.
    fn check_process(&self, py: Python<'_>) -> PyResult<()> {
        self.0.check_process().map_err(|error| raise(py, error))
    }

    /// The step nearest to a time (s).
    fn nearest_step(&self, py: Python<'_>, time: f64) -> PyResult<u64> {
        self.0.nearest_step(time).map_err(|error| raise(py, error))
    }

    /// Looks for failures that no step has told yet.
    fn check(&self, py: Python<'_>) -> PyResult<()> {
        without_lock(py, || self.0.check())
    }

    fn steps(&self, py: Python<'_>) -> PyResult<u64> {
        without_lock(py, || self.0.steps_done())
    }

    fn particles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyByteArray>> {
        Ok(bytes(py, &without_lock(py, || self.0.particles())?))
    }

    fn set_particles(&self, py: Python<'_>, rows: &[u8]) -> PyResult<()> {
        let states = pod_collect_to_vec(rows);
        without_lock(py, || self.0.set_particles(states))
    }

    fn loads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyByteArray>> {
        let loads = without_lock(py, || self.0.loads())?;
        let rows: Vec<LoadRow> = loads.into_iter().map(LoadRow::from).collect();
        Ok(bytes(py, &rows))
    }

    fn set_external_loads(&self, py: Python<'_>, rows: &[u8]) -> PyResult<()> {
        let loads = loads_of(rows);
        without_lock(py, || self.0.set_external_loads(loads))
    }

    /// Velocity, pressure and solid fraction as `f32`, x fastest.
    fn fields<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyByteArray>; 3]> {
        let fields = without_lock(py, || self.0.fields())?;
        Ok([bytes(py, &fields.velocity), bytes(py, &fields.pressure), bytes(py, &fields.solid_fraction)])
    }

    /// Mean velocity of the mixture (m/s) and solid volume fraction (-).
    fn mean_flow(&self, py: Python<'_>) -> PyResult<([f64; 3], f64)> {
        let flow = without_lock(py, || self.0.on_ranks(|simulation| Ok(simulation.measure().mean)))?[0];
        Ok((flow.velocity.into(), flow.solid_fraction))
    }

    fn state_hash(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(without_lock(py, || self.0.on_ranks(|simulation| Ok(simulation.state_hash())))?[0])
    }

    /// Density (kg/m^3), volume (m^3), circumradius (m), moments of inertia (kg m^2), axes, of each kind.
    #[expect(clippy::type_complexity, reason = "a row of numbers")]
    fn kinds(&self) -> Vec<(f64, f64, f64, [f64; 3], [f64; 4])> {
        let setup = self.0.setup();
        let kinds = setup.templates.iter().zip(&setup.frames).map(|(kind, frame)| {
            let shape = &kind.shape;
            (kind.density, shape.volume(), shape.circumradius(), kind.inertia().into(), frame.coords.into())
        });
        kinds.collect()
    }

    #[getter]
    fn time_step(&self) -> f64 {
        self.0.setup().time_step
    }

    #[getter]
    fn end_step(&self) -> u64 {
        self.0.setup().plan.end_step
    }

    #[getter]
    fn cells(&self) -> [usize; 3] {
        self.0.setup().domain.cells
    }

    /// First cell of this process along x, y, z, and the one after the last.
    #[getter]
    fn block(&self) -> ([usize; 3], [usize; 3]) {
        let block = self.0.block();
        (block.lo, block.hi)
    }

    #[getter]
    fn has_fluid(&self) -> bool {
        self.0.setup().fluid.is_some()
    }

    #[getter]
    fn dx(&self) -> f64 {
        self.0.setup().domain.dx
    }

    #[getter]
    fn periodic(&self) -> [bool; 3] {
        self.0.setup().domain.periodic()
    }

    #[getter]
    fn gravity(&self) -> [f64; 3] {
        self.0.setup().gravity.into()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.setup().provenance.warnings.clone()
    }

    #[getter]
    fn toml(&self) -> String {
        self.0.setup().provenance.text.clone()
    }
}

/// Runs a case to its end with all its files; the summary as JSON. A signal whose handler raises stops the run, files closed.
#[pyfunction]
fn run(
    py: Python<'_>,
    form: &str,
    text: String,
    options: Vec<String>,
    threads: Option<usize>,
    overwrite: bool,
) -> PyResult<String> {
    let setup = with_case(py, (form, text), (options, threads), case::read_alone)?;
    let options = RunOptions { overwrite, ..RunOptions::default() };
    let stop = options.stop.clone();
    let thread = std::thread::spawn(move || simulation::run(&setup, &options));
    let mut raised = Ok(());
    while raised.is_ok() && !thread.is_finished() {
        py.detach(|| std::thread::sleep(Duration::from_millis(5)));
        raised = py.check_signals();
    }
    stop.store(raised.is_err(), Ordering::Relaxed);
    let result = py.detach(|| thread.join()).unwrap_or_else(|panic| resume_unwind(panic));
    raised?;
    let summary = result.map_err(|error| raise(py, error))?;
    serde_json::to_string(&summary).map_err(|why| PyValueError::new_err(why.to_string()))
}

#[pymodule]
mod _turbid {
    #[pymodule_export]
    use super::{Error, Session, run};

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "as Python has it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
