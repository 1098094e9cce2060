// Turbid's C interface to LIGGGHTS: every call guarded, every error of the library a value.
//
// The methods of LAMMPS_NS::Error below have the names of those in libliggghts. The executable comes first in the lookup
// of symbols, and the library calls its own methods through that lookup, so these are the ones that run: they throw
// instead of ending the process. Part of liggghts-sys, GPL-2.0-or-later.

#include "shim.h"

#include <mpi.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "lammps.h"

#include "atom.h"
#include "atom_vec.h"
#include "compute.h"
#include "error.h"
#include "fix.h"
#include "library.h"
#include "modify.h"
#include "update.h"

using namespace LAMMPS_NS;

struct lgg_instance {
  void *lammps;
  bool broken;
  std::vector<double> rows;
};

namespace {

struct Failure : std::exception {
  explicit Failure(const std::string &text) : text(text) {}
  const char *what() const noexcept override { return text.c_str(); }
  std::string text;
};

thread_local std::string last_error;

// The processes of the instance of this one, if there are several.
MPI_Comm processes = MPI_COMM_NULL;

[[noreturn]] void fail(const std::string &text, const char *file, int line) {
  // The reader of a message has no use for the directories of the one who built the library.
  const char *name = file ? std::strrchr(file, '/') : nullptr;
  name = name ? name + 1 : file;
  std::string where = name ? std::string(" (") + name + ":" + std::to_string(line) + ")" : "";
  throw Failure(text + where);
}

// An error in one of several processes: the others wait for it in a call of MPI.
[[noreturn]] void fail_alone(const std::string &text, const char *file, int line) {
  if (processes == MPI_COMM_NULL)
    fail(text, file, line);
  int rank = 0;
  MPI_Comm_rank(processes, &rank);
  std::fprintf(stderr, "error: LIGGGHTS has failed in process %d: %s\n", rank, text.c_str());
  std::fflush(nullptr);
  MPI_Abort(processes, 3);
  std::abort();
}

template <class Body> int guarded(Body body) {
  try {
    body();
    return 0;
  } catch (const std::exception &e) {
    last_error = e.what();
  } catch (...) {
    last_error = "an exception that says nothing";
  }
  std::fflush(nullptr);
  return 1;
}

LAMMPS *of(lgg_instance *instance) { return static_cast<LAMMPS *>(instance->lammps); }

// Whether a failure of the command leaves pointers to what it has freed: these styles are freed before their successors
// exist, and so is a fix or compute that is given anew under its old name.
bool replaces(LAMMPS *lammps, const char *command) {
  std::istringstream words(command);
  std::string word, id;
  words >> word >> id;
  if (word == "atom_style" || word == "pair_style")
    return true;
  if (id.empty())
    return false;
  return (word == "fix" && lammps->modify->find_fix(&id[0]) >= 0) ||
         (word == "compute" && lammps->modify->find_compute(&id[0]) >= 0);
}

} // namespace

void Error::all(const char *file, int line, const char *text) { fail(text, file, line); }
void Error::one(const char *file, int line, const char *text) { fail_alone(text, file, line); }
void Error::universe_all(const char *file, int line, const char *text) { fail(text, file, line); }
void Error::universe_one(const char *file, int line, const char *text) { fail_alone(text, file, line); }
void Error::fix_error(const char *file, int line, Fix *fix, const char *text) {
  fail(std::string("fix ") + fix->style + " (id " + fix->id + "): " + text, file, line);
}
void Error::fix_error(const char *file, int line, Fix *fix, const char *style, const char *text) {
  fail(std::string("fix ") + style + " (id " + fix->id + "): " + text, file, line);
}
void Error::compute_error(const char *file, int line, Compute *compute, const char *text) {
  fail(std::string("compute ") + compute->style + " (id " + compute->id + "): " + text, file, line);
}
void Error::done() { fail("the command `quit`", nullptr, 0); }

extern "C" {

const char *lgg_error(void) { return last_error.c_str(); }

int lgg_is_broken(const lgg_instance *instance) { return instance->broken; }

int lgg_open(const char *screen, const int32_t *communicator, lgg_instance **out) {
  *out = nullptr;
  return guarded([&] {
    // `-screen none` makes some styles print to a null pointer.
    const char *words[] = {"liggghts", "-log", "none", "-nocite", "-screen", screen};
    std::vector<std::string> store(words, words + 6);
    std::vector<char *> arguments;
    for (std::string &word : store)
      arguments.push_back(&word[0]);
    void *lammps = nullptr;
    int count = static_cast<int>(arguments.size());
    if (communicator) {
      processes = MPI_Comm_f2c(*communicator);
      lammps_open(count, arguments.data(), processes, &lammps);
    } else {
      lammps_open_no_mpi(count, arguments.data(), &lammps);
    }
    if (!lammps)
      throw Failure("LIGGGHTS does not start");
    *out = new lgg_instance{lammps, false, {}};
  });
}

void lgg_close(lgg_instance *instance) {
  if (!instance->broken)
    guarded([&] { lammps_close(instance->lammps); });
  delete instance;
}

void lgg_finalize(void) {
  int running = 0, ended = 0;
  MPI_Initialized(&running);
  MPI_Finalized(&ended);
  if (running && !ended)
    MPI_Finalize();
}

void lgg_flush_lines(void) { std::setvbuf(stdout, nullptr, _IOLBF, 0); }

void lgg_flush(void) { std::fflush(nullptr); }

int lgg_command(lgg_instance *instance, const char *command) {
  bool risky = !instance->broken && replaces(of(instance), command);
  int failed = guarded([&] {
    if (instance->broken)
      throw Failure("LIGGGHTS cannot continue after its last error");
    // The library writes into the text.
    std::vector<char> text(command, command + std::strlen(command) + 1);
    lammps_command(instance->lammps, text.data());
  });
  if (failed && risky)
    instance->broken = true;
  return failed;
}

int lgg_create(lgg_instance *instance, int64_t count, const int32_t *id, const double *position) {
  return guarded([&] {
    Atom *atom = of(instance)->atom;
    for (int64_t n = 0; n < count; n++) {
      double at[3] = {position[3 * n], position[3 * n + 1], position[3 * n + 2]};
      atom->avec->create_atom(1, at);
      atom->tag[atom->nlocal - 1] = id[n];
    }
    int64_t local = atom->nlocal, total = 0;
    MPI_Allreduce(&local, &total, 1, MPI_INT64_T, MPI_SUM, of(instance)->world);
    atom->natoms = total;
    atom->nghost = 0;
    atom->map_init();
    atom->map_set();
  });
}

int lgg_any(lgg_instance *instance, int flag) {
  int any = flag;
  MPI_Allreduce(&flag, &any, 1, MPI_INT, MPI_LOR, of(instance)->world);
  return any;
}

int32_t lgg_type_of(lgg_instance *instance, int32_t id) {
  Atom *atom = of(instance)->atom;
  int index = id > 0 && id <= atom->map_tag_max ? atom->map(id) : -1;
  return index < 0 ? 0 : atom->type[index];
}

int lgg_get_atoms(lgg_instance *instance, lgg_atoms *out) {
  return guarded([&] {
    Atom *atom = of(instance)->atom;
    if (atom->nlocal == 0) {
      *out = lgg_atoms();
      out->total = static_cast<int64_t>(atom->natoms);
      return;
    }
    if (!atom->x || !atom->omega || !atom->torque || !atom->radius || !atom->rmass || !atom->density)
      throw Failure("the atoms have no position, turning, radius or mass");
    out->local = atom->nlocal;
    out->total = static_cast<int64_t>(atom->natoms);
    out->id = atom->tag;
    out->type = atom->type;
    out->position = atom->x[0];
    out->velocity = atom->v[0];
    out->angular_velocity = atom->omega[0];
    out->force = atom->f[0];
    out->torque = atom->torque[0];
    out->radius = atom->radius;
    out->mass = atom->rmass;
    out->density = atom->density;
  });
}

int lgg_atom_property(lgg_instance *instance, const char *name, double **values) {
  return guarded([&] {
    std::string id(name);
    double **vectors = static_cast<double **>(lammps_extract_fix(instance->lammps, &id[0], 1, 2, 0, 0));
    if (!vectors)
      throw Failure("there is no property of atoms `" + id + "`");
    *values = vectors[0];
  });
}

int lgg_local_compute(lgg_instance *instance, const char *name, int64_t *rows, int64_t *columns,
                      const double **values) {
  return guarded([&] {
    Modify *modify = of(instance)->modify;
    std::string id(name);
    int index = modify->find_compute(&id[0]);
    if (index < 0)
      throw Failure("there is no compute `" + id + "`");
    Compute *compute = modify->compute[index];
    compute->compute_local();
    *rows = compute->size_local_rows;
    *columns = compute->size_local_cols;
    instance->rows.clear();
    for (int i = 0; i < compute->size_local_rows; i++)
      instance->rows.insert(instance->rows.end(), compute->array_local[i],
                            compute->array_local[i] + compute->size_local_cols);
    *values = instance->rows.data();
  });
}

} // extern "C"
