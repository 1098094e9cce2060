/* Turbid as the fluid of an external DEM. All quantities are in SI units.
 *
 * Every function but the last two returns TURBID_OK or an error code, with the text in turbid_last_error(). Functions may be called
 * from any thread; calls for one handle follow each other. Made by cbindgen from ffi/c/src: do not edit.
 */

#ifndef TURBID_H
#define TURBID_H

#include <stddef.h>
#include <stdint.h>

// Done.
#define TURBID_OK 0

// A null pointer, an invalid handle, or an array of the wrong length.
#define TURBID_ARGUMENT 1

// A case, a file or states that are not possible, or not enough memory.
#define TURBID_INPUT 2

// The simulation diverged, or its engine or device failed.
#define TURBID_FAILED 3

// A defect of Turbid; please report it.
#define TURBID_PANIC 5

// An open simulation; never 0.
typedef int64_t turbid_handle;

// Sizes and constants of a case.
typedef struct turbid_info {
  // Number of particles, of all processes.
  size_t particles;
  // Number of cells along x, y, z.
  size_t cells[3];
  // Edge of a cell (m).
  double dx;
  // Time step (s).
  double time_step;
  // Time at the end of the case (s).
  double end_time;
  // Gravity (m/s^2).
  double gravity[3];
  // Density of the fluid (kg/m^3); 0 without one.
  double fluid_density;
  // Kinematic viscosity of the fluid (m^2/s); 0 without one.
  double fluid_viscosity;
  // 1 where the box is periodic along x, y, z, else 0.
  int32_t periodic[3];
} turbid_info;

// Mass and size of a particle, which do not change.
typedef struct turbid_body {
  // Mass (kg).
  double mass;
  // Volume (m^3).
  double volume;
  // Circumscribed radius (m): the radius of a sphere.
  double radius;
  // Principal moments of inertia (kg m^2).
  double moments[3];
  // Unit quaternion (i, j, k, w) from the principal axes of the body to those in which the case gives its shape.
  double frame[4];
} turbid_body;

// State of a particle.
typedef struct turbid_particle {
  // Unique number.
  uint64_t id;
  // Kind of the case, from 0.
  uint64_t kind;
  // Centre of mass (m).
  double position[3];
  // Unit quaternion (i, j, k, w) from the principal axes of the body to those of the box.
  double orientation[4];
  // Velocity of the centre of mass (m/s).
  double velocity[3];
  // Angular velocity (1/s).
  double angular_velocity[3];
} turbid_particle;

// Load on a particle.
typedef struct turbid_load {
  // Force on the centre of mass (N).
  double force[3];
  // Torque about the centre of mass (N m).
  double torque[3];
} turbid_load;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Opens a case from the file at `path` and stores its handle. `options` are lines that replace keys, as `--set` of the program
// ("run.threads=1\nfluid.viscosity=1e-5"), or null. With `caller_moves` the caller moves the particles by
// `turbid_set_particles`, else the engine of the case does.
//
// # Safety
// Texts end with a zero; `handle` is null or points to a handle.
int32_t turbid_open_file(const char *path,
                         const char *options,
                         int32_t caller_moves,
                         turbid_handle *handle);

// The same for the text of a case.
//
// # Safety
// As `turbid_open_file`.
int32_t turbid_open_text(const char *text, const char *options, int32_t caller_moves, turbid_handle *handle);

// Opens a case from the file at `path` on the processes of a communicator, of which each has a block of the box: `communicator` is its
// handle of Fortran's, `MPI_Comm_c2f(comm)`. The caller has started MPI by `MPI_Init_thread` with at least `MPI_THREAD_SERIALIZED`, as Turbid
// calls it from a thread of its own, on a copy of the communicator. Needs a libturbid built with the feature `mpi`.
//
// All functions with its handle are collective then, but `turbid_get_info` and `turbid_get_block`: all processes call them, in the same order.
// Arrays of particles are of those of this process, ascending by id: those that it has set last, or those in its block if it has
// set none.
//
// # Safety
// As `turbid_open_file`; `communicator` is that of a communicator.
int32_t turbid_open_comm_file(const char *path,
                              const char *options,
                              int32_t caller_moves,
                              int32_t communicator,
                              turbid_handle *handle);

// The same for the text of a case.
//
// # Safety
// As `turbid_open_comm_file`.
int32_t turbid_open_comm_text(const char *text,
                              const char *options,
                              int32_t caller_moves,
                              int32_t communicator,
                              turbid_handle *handle);

// Frees a simulation. Its handle is invalid from then on.
int32_t turbid_close(turbid_handle handle);

// Advances by `count` time steps. With particles that the caller moves: gives the loads for the states that were set last, then
// moves the particles on at their velocities.
//
// `TURBID_FAILED` for a failure in these steps; a fluid that is too fast is noticed in every eighth step only. From then on each
// call gives the same error; what has been reached can still be read.
int32_t turbid_step(turbid_handle handle,
                    uint64_t count);

// Advances to the step nearest to `time` (s), and checks for failures, also of the fluid.
int32_t turbid_run_until(turbid_handle handle, double time);

// Time since the start (s) and steps done; either pointer may be null.
//
// # Safety
// Each pointer is null or points to a number.
int32_t turbid_get_time(turbid_handle handle, double *time, uint64_t *steps);

// Sizes and constants of a case.
//
// # Safety
// `info` is null or points to a `turbid_info`.
int32_t turbid_get_info(turbid_handle handle, struct turbid_info *info);

// Number of particles of this process: of all, unless it is one of several on a communicator.
//
// # Safety
// `count` is null or points to a number.
int32_t turbid_get_count(turbid_handle handle, size_t *count);

// First cell of this process along x, y, z, and the one after the last: of the whole box, unless it is one of several on a communicator.
//
// # Safety
// Each pointer is null or has room for three numbers.
int32_t turbid_get_block(turbid_handle handle,
                         size_t *first,
                         size_t *end);

// Masses and sizes of the particles of this process, in the order of `turbid_get_particles`. `count` is their number.
//
// # Safety
// `bodies` is null or has room for `count` of them.
int32_t turbid_get_bodies(turbid_handle handle,
                          struct turbid_body *bodies,
                          size_t count);

// States of the particles of this process, ascending by id. `count` is their number.
//
// # Safety
// `particles` is null or has room for `count` of them.
int32_t turbid_get_particles(turbid_handle handle, struct turbid_particle *particles, size_t count);

// Sets the states of all particles, ascending by id; one of several processes on a communicator gives any of them, and has these from then on.
// Positions are wrapped, orientations normalised. The fluid meets them in the
// next step. Refused are states that are not finite, that move by more than a cell or half a turn in a step, that overlap others or
// walls by more than a quarter of the thickness; and, where the caller moves the particles, positions more than a cell from those
// before the last step, if there was one. On an error nothing has changed.
//
// # Safety
// `particles` is null or points to `count` of them.
int32_t turbid_set_particles(turbid_handle handle,
                             const struct turbid_particle *particles,
                             size_t count);

// Loads of the fluid on the particles of this process in the last step: with buoyancy, without weight. Zeros before the first step.
//
// # Safety
// `loads` is null or has room for `count` of them.
int32_t turbid_get_loads(turbid_handle handle,
                         struct turbid_load *loads,
                         size_t count);

// Loads of the caller that the engine of the case adds to those of the fluid, from now on in every step. Refused where the caller
// moves the particles.
//
// # Safety
// `loads` is null or points to `count` of them.
int32_t turbid_set_external_loads(turbid_handle handle,
                                  const struct turbid_load *loads,
                                  size_t count);

// Fields of the cells of this process (`turbid_get_block`), of which `cells` is the number: `velocity` (m/s, three numbers a cell), `pressure` (Pa above that of the
// fluid at rest) and `solid_fraction` (-). Cell (x, y, z), counted from the first one, is number
// x + nx (y + ny z). Any of the pointers may be null.
//
// # Safety
// Each pointer is null or has room for its numbers: `3 * cells` of `velocity`, `cells` of the others.
int32_t turbid_get_fields(turbid_handle handle,
                          float *velocity,
                          float *pressure,
                          float *solid_fraction,
                          size_t cells);

// Mean velocity of fluid and particles together (m/s, three numbers) and solid volume fraction (-) of the box.
//
// # Safety
// `velocity` is null or has room for three numbers, `solid_fraction` is null or points to one.
int32_t turbid_get_mean_flow(turbid_handle handle,
                             double *velocity,
                             double *solid_fraction);

// Text of the last error on this thread; empty before the first. It stays until the next error on this thread.
const char *turbid_last_error(void);

// Version of Turbid.
const char *turbid_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TURBID_H */
