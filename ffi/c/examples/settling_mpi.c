/* The DEM of settling.c in several processes, which drive Turbid on their communicator. Prints the same numbers.
 *
 *   mpirun -n 3 settling_mpi [SECONDS]
 *
 * The DEM has slabs of equal heights of its own, while Turbid cuts the box in its way: a process has the spheres in its slab, gets their
 * loads, moves them, and sets them. As they settle they go from one process to another. For contacts every process knows all spheres;
 * a DEM of many has ghosts in their place.
 */

#include "spheres.h"
#include <mpi.h>

static int rank, ranks;

/* Puts the lists of all processes, of `count` things of `size` bytes here, one after the other. */
static void gather(const void *own, size_t count, size_t size, void *all) {
    int *bytes = room((size_t)ranks, sizeof *bytes), *start = room((size_t)ranks, sizeof *start);
    bytes[rank] = (int)(count * size);
    MPI_Allgather(MPI_IN_PLACE, 0, MPI_INT, bytes, 1, MPI_INT, MPI_COMM_WORLD);
    for (int other = 1; other < ranks; other++) {
        start[other] = start[other - 1] + bytes[other - 1];
    }
    MPI_Allgatherv(own, bytes[rank], MPI_BYTE, all, bytes, start, MPI_BYTE, MPI_COMM_WORLD);
    free(bytes);
    free(start);
}

int main(int count, char **arguments) {
    int level;
    /* Turbid calls MPI from a thread of its own, while this one waits. */
    MPI_Init_thread(&count, &arguments, MPI_THREAD_SERIALIZED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    double end = count > 1 ? atof(arguments[1]) : 0.2;
    turbid_handle fluid = 0;
    must(turbid_open_comm_text(CASE, NULL, 1, MPI_Comm_c2f(MPI_COMM_WORLD), &fluid));
    turbid_info info;
    must(turbid_get_info(fluid, &info));
    size_t spheres = info.particles, owned;
    turbid_body *body = room(spheres, sizeof *body), *some = room(spheres, sizeof *some);
    turbid_particle *own = room(spheres, sizeof *own), *particle = room(spheres, sizeof *particle),
                    *known = room(spheres, sizeof *known);
    turbid_load *load = room(spheres, sizeof *load);
    double(*force)[3] = room(spheres, sizeof *force);

    /* At first a process has the particles in its block of the fluid. The ids of the case count from 0. */
    must(turbid_get_count(fluid, &owned));
    must(turbid_get_particles(fluid, own, owned));
    must(turbid_get_bodies(fluid, body, owned));
    gather(body, owned, sizeof *body, some);
    gather(own, owned, sizeof *own, known);
    for (size_t i = 0; i < spheres; i++) {
        body[known[i].id] = some[i];
        particle[known[i].id] = known[i];
    }

    if (rank == 0) {
        printf("# time (s)  heights (mm)\n");
    }
    double slab = (double)info.cells[2] * info.dx / ranks;
    long steps = lround(end / info.time_step), early = lround(0.02 / info.time_step), moves = 0;
    for (long step = 1; step <= steps; step++) {
        must(turbid_step(fluid, 1));
        must(turbid_get_loads(fluid, load, owned));
        for (int substep = 0; substep < SUBSTEPS; substep++) {
            for (size_t n = 0; n < owned; n++) {
                contacts(own[n].id, particle, body, spheres, &info, force[n]);
            }
            for (size_t n = 0; n < owned; n++) {
                move(&own[n], &body[own[n].id], force[n], &load[n], &info);
            }
            gather(own, owned, sizeof *own, known);
            for (size_t i = 0; i < spheres; i++) {
                particle[known[i].id] = known[i];
            }
        }
        size_t before = owned;
        owned = 0;
        for (size_t i = 0; i < spheres; i++) {
            int place = (int)(particle[i].position[2] / slab);
            if ((place < 0 ? 0 : place >= ranks ? ranks - 1 : place) == rank) {
                own[owned++] = particle[i];
            }
        }
        moves += owned > before;
        must(turbid_set_particles(fluid, own, owned));
        if (rank == 0 && (step % 96 == 0 || step == steps)) {
            printf("%.4f", (double)step * info.time_step);
            for (size_t i = 0; i < spheres; i++) {
                printf("  %.4f", 1e3 * particle[i].position[2]);
            }
            printf("\n");
        }
        if (rank == 0 && step == early) {
            printf("velocity of sphere 0 at 0.02 s: %.6e m/s\n", particle[0].velocity[2]);
        }
    }
    MPI_Allreduce(MPI_IN_PLACE, &moves, 1, MPI_LONG, MPI_SUM, MPI_COMM_WORLD);
    if (rank == 0) {
        fprintf(stderr, "spheres that went to another process: %ld\n", moves);
    }
    free(body);
    free(some);
    free(own);
    free(particle);
    free(known);
    free(load);
    free(force);
    must(turbid_close(fluid));
    MPI_Finalize();
    return 0;
}
