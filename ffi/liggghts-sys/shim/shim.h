/* Turbid's C interface to LIGGGHTS. Every call that can fail returns 0, or not 0 with the reason in lgg_error().
 * Plain C, without any header of LIGGGHTS or MPI. Part of liggghts-sys, GPL-2.0-or-later. */
#ifndef TURBID_LIGGGHTS_SHIM_H
#define TURBID_LIGGGHTS_SHIM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An instance of LIGGGHTS. */
typedef struct lgg_instance lgg_instance;

/* Arrays of the atoms of this process, valid until the next command; vectors are three doubles an atom, contiguous. */
typedef struct {
  int64_t local;   /* number of atoms here */
  int64_t total;   /* number of atoms in the simulation */
  int32_t *id;     /* from 1 */
  int32_t *type;   /* from 1 */
  double *position;
  double *velocity;
  double *angular_velocity;
  double *force;
  double *torque;
  double *radius;
  double *mass;
  double *density;
} lgg_atoms;

/* The reason of the last failure in this thread. Never null. */
const char *lgg_error(void);

/* Whether an error of LIGGGHTS has left pointers that a later call would follow: then nothing may be called any more. */
int lgg_is_broken(const lgg_instance *instance);

/* Starts LIGGGHTS, with MPI if it does not run yet; prints to the file `screen` (a path). With a communicator (its Fortran
 * handle, else null) it runs in all its processes, each of which makes the same calls; only lgg_error, lgg_is_broken and the calls
 * that return arrays are not collective then. An error that LIGGGHTS finds in one process alone ends all of them. */
int lgg_open(const char *screen, const int32_t *communicator, lgg_instance **instance);

/* Ends LIGGGHTS; a broken instance is left as it is. MPI keeps running. */
void lgg_close(lgg_instance *instance);

/* Ends MPI, if it runs and nobody else has ended it. */
void lgg_finalize(void);

/* Makes the standard output of this process appear line by line. */
void lgg_flush_lines(void);

/* Writes out what the streams of this process hold back: a crash would lose it. */
void lgg_flush(void);

/* A command of a LIGGGHTS script. */
int lgg_command(lgg_instance *instance, const char *command);

/* Makes `count` atoms of the first type with these ids, from 1, at these positions; the rest of them is to be set. */
int lgg_create(lgg_instance *instance, int64_t count, const int32_t *id, const double *position);

/* Whether `flag` is not 0 in any process. */
int lgg_any(lgg_instance *instance, int flag);

/* Type, from 1, of an atom that this process has, perhaps as a copy of a neighbouring one; 0 if it has none. */
int32_t lgg_type_of(lgg_instance *instance, int32_t id);

/* The arrays of the atoms. */
int lgg_get_atoms(lgg_instance *instance, lgg_atoms *atoms);

/* Three doubles an atom of the fix property/atom `name`, valid until the next command. */
int lgg_atom_property(lgg_instance *instance, const char *name, double **values);

/* Rows and columns of the local compute `name` at the present time, and its values row by row; valid until the next
 * call. */
int lgg_local_compute(lgg_instance *instance, const char *name, int64_t *rows, int64_t *columns,
                      const double **values);

#ifdef __cplusplus
}
#endif

#endif
