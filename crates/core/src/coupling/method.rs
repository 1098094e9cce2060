//! The methods of coupling: the one place where a method is chosen.

use super::Coupling;
use super::cover::Cover;
use super::homogenised::Homogenised;
use super::mapper::{Image, Mapper};
use super::saturated::{Saturated, SolidOperator};
use crate::domain::Block;
use crate::fluid::{
    Asked, BlockSolids, Collision, ExchangeSum, Flow, FlowRow, Fluid, Images, Population, RigidMotion,
    RowSegments, Simd, SolidModel, SphereRows, Stresslet,
};
use crate::particle::Particle;
use crate::shape::Shape;
use std::fmt;
use std::sync::Arc;

/// Method of coupling particles and fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Homogenised cells ("homogenised" in case files, earlier "paper").
    Homogenised(Homogenised),
    /// Partially saturated cells.
    Saturated(Saturated),
}

/// Evaluates an expression for the method.
macro_rules! with_method {
    ($method:expr, $name:ident => $work:expr) => {
        match $method {
            crate::coupling::Method::Homogenised($name) => $work,
            crate::coupling::Method::Saturated($name) => $work,
        }
    };
}
pub(super) use with_method;

impl Method {
    /// Name in case files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Homogenised(_) => "homogenised",
            Self::Saturated(_) => "saturated",
        }
    }

    /// The collision of a fluid that is not given another one, and with which its errors are measured: the drag of partially saturated cells
    /// depends least on the relaxation time and the resolution with this magic parameter (validation/drag).
    pub fn usual_collision(&self) -> Collision {
        match self {
            Self::Homogenised(_) => Collision::Bgk,
            Self::Saturated(_) => Collision::Trt { magic: 0.125 },
        }
    }

    /// Half the width of the layer (cells) outside of which cells are wholly solid or wholly fluid.
    pub fn half_layer(&self) -> f64 {
        with_method!(self, method => method.half_layer())
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Homogenised(h) => write!(f, "exact difference, ramp of {} cells", h.ramp),
            Self::Saturated(s) => {
                write!(f, "partially saturated cells by volume, operator {}", s.operator.name())
            }
        }
    }
}

/// Momentum and moving mass that left some cells in the last sweep, by [`Fluid::departed`].
pub(super) type Departed<'a> = dyn FnMut(&[[usize; 3]]) -> Vec<[f64; 4]> + 'a;

/// All that a method does besides the collision of covered cells.
pub(super) trait CouplingMethod: SolidModel {
    /// As [`Method::half_layer`].
    fn half_layer(self) -> f64;

    /// Body whose surface, moved in by a distance (cells), the fluid takes for that of a body.
    fn felt(self, shape: &Arc<dyn Shape>, _dx: f64) -> (Arc<dyn Shape>, f64) {
        (shape.clone(), 0.0)
    }

    /// Returns true if [`correct_cover`](Self::correct_cover) needs the cells that were covered in the last sweep.
    fn keeps_cover(self) -> bool {
        false
    }

    /// Returns true for a polyhedron of one part whose cells may be kept while it moves little.
    fn may_keep(self, _part: &Mapper) -> bool {
        false
    }

    /// Adds the cells that an image of a body covers, with their solid fractions.
    fn cover(self, mapper: &Mapper, image: &Image, cover: &mut Cover, simd: Simd);

    /// Momentum of fluid that fills a body and moves with it, if it counts as that of the body; lattice units.
    fn momentum_inside(
        self,
        _particle: &Particle,
        _shape: &dyn Shape,
        _motion: &RigidMotion,
        _dx: f64,
    ) -> ExchangeSum {
        ExchangeSum::default()
    }

    /// Corrects the exchange for cells that were covered only in the last sweep or only now. `departed` gives what left
    /// some cells, `old_of` and `new_of` the index of each body in the other of the two lists, or [`NONE`](super::NONE).
    fn correct_cover(
        self,
        _coupling: &mut Coupling,
        _departed: &mut Departed,
        _old_of: &[u32],
        _new_of: &[u32],
    ) {
    }
}

impl Coupling {
    /// The mapped particles as the fluid sees them.
    pub(super) fn solids<M: CouplingMethod>(&mut self, model: M) -> BlockSolids<'_, M> {
        BlockSolids {
            segments: [&self.segments, &self.polyhedra.rows],
            spheres: &self.spheres.rows,
            bodies: &mut self.bodies,
            model,
            images: self.images.as_ref(),
        }
    }

    /// Collides and streams all cells round the mapped particles, which receive their exchange of momentum, under a uniform
    /// acceleration (cells per step squared); returns the measurements of the cells before that are asked for. Collective.
    pub fn sweep<'a, S: Population>(
        &mut self,
        fluid: &mut Fluid<S>,
        acceleration: [f64; 3],
        asked: impl Into<Asked<'a>>,
    ) -> Option<Flow> {
        self.begin_exchange(fluid);
        let flow = with_method!(self.params.method, method => {
            fluid.sweep(acceleration, &mut self.solids(method), asked)
        });
        self.swept_count = fluid.cover_count();
        flow
    }

    /// Flow as the next measuring sweep would find it, and the stresslets of the particles by their ids, over the cells of the block:
    /// [`Fluid::measure`].
    pub fn measure<S: Population>(
        &mut self,
        fluid: &Fluid<S>,
        acceleration: [f64; 3],
    ) -> (Flow, Vec<(u64, Stresslet)>) {
        self.find_cells();
        let (flow, stresslets) =
            with_method!(self.params.method, method => fluid.measure(acceleration, &self.solids(method)));
        (flow, self.bodies.iter().map(|body| body.id).zip(stresslets).collect())
    }

    /// [`Fluid::each_row`] with the mapped particles.
    pub fn each_row<S: Population>(
        &mut self,
        fluid: &Fluid<S>,
        cells: Block,
        acceleration: [f64; 3],
        visit: &mut dyn FnMut(&FlowRow),
    ) {
        self.find_cells();
        with_method!(self.params.method, method => {
            fluid.each_row(cells, acceleration, &self.solids(method), visit);
        });
    }
}

/// [`Fluid::sweep`] without particles. Collective.
pub(crate) fn sweep_alone<S: Population>(
    fluid: &mut Fluid<S>,
    acceleration: [f64; 3],
    measure: bool,
) -> Option<Flow> {
    // Homogenised cells are compiled for more collisions, but not for this one.
    let method = match fluid.collision() {
        Collision::RecursiveRegularised { .. } => Method::Saturated(Saturated::new(SolidOperator::default())),
        Collision::Bgk | Collision::Trt { .. } => Method::Homogenised(Homogenised { ramp: 1.0 }),
    };
    with_method!(method, model => {
        let solids = &mut BlockSolids {
            segments: [&RowSegments::default(), &RowSegments::default()],
            spheres: &SphereRows::default(),
            bodies: &mut [],
            model,
            images: Some(&Images::default()),
        };
        fluid.sweep(acceleration, solids, measure)
    })
}
