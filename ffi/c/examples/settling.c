/* A DEM of its own drives Turbid as its fluid: spheres settle, hit the floor and come to rest on it and on each other.
 *
 * Contacts are those of spheres.h, of all pairs. A step of the fluid gives the loads for the states that were set last; the DEM
 * then moves the spheres under these loads and their weight, in sub-steps that resolve a contact.
 *
 *   settling [SECONDS]                     three spheres
 *   settling SECONDS CASE.toml [native]    spheres of a case; with `native` the engine of the case moves them, for comparison
 *
 * Prints
 *
 *   # time (s)  heights (mm)
 *   ...
 *   velocity of sphere 0 at 0.02 s: -3.6e-02 m/s
 *
 * or the mean velocity of the spheres of the case at the end, and the times that a step and the DEM in it take.
 */

#define _POSIX_C_SOURCE 199309L

#include "spheres.h"
#include <time.h>

/* Seconds of some clock. */
static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

int main(int count, char **arguments) {
    double end = count > 1 ? atof(arguments[1]) : 0.2, in_dem = 0.0;
    int alone = count < 3, native = count > 3;
    turbid_handle fluid = 0;
    must(alone ? turbid_open_text(CASE, "run.threads=1", 1, &fluid) : turbid_open_file(arguments[2], NULL, !native, &fluid));
    turbid_info info;
    must(turbid_get_info(fluid, &info));
    size_t spheres = info.particles;
    turbid_body *body = room(spheres, sizeof *body);
    turbid_particle *particle = room(spheres, sizeof *particle);
    turbid_load *load = room(spheres, sizeof *load);
    double(*force)[3] = room(spheres, sizeof *force);
    must(turbid_get_bodies(fluid, body, spheres));
    must(turbid_get_particles(fluid, particle, spheres));

    if (alone) {
        printf("# time (s)  heights (mm)\n");
    }
    long steps = lround(end / info.time_step), early = lround(0.02 / info.time_step);
    double start = now();
    for (long step = 1; step <= steps; step++) {
        must(turbid_step(fluid, 1));
        if (!native) {
            double before = now();
            must(turbid_get_loads(fluid, load, spheres));
            for (int substep = 0; substep < SUBSTEPS; substep++) {
                for (size_t i = 0; i < spheres; i++) {
                    contacts(i, particle, body, spheres, &info, force[i]);
                }
                for (size_t i = 0; i < spheres; i++) {
                    move(&particle[i], &body[i], force[i], &load[i], &info);
                }
            }
            must(turbid_set_particles(fluid, particle, spheres));
            in_dem += now() - before;
        }
        if (alone && (step % 96 == 0 || step == steps)) {
            printf("%.4f", (double)step * info.time_step);
            for (size_t i = 0; i < spheres; i++) {
                printf("  %.4f", 1e3 * particle[i].position[2]);
            }
            printf("\n");
        }
        if (alone && step == early) {
            printf("velocity of sphere 0 at 0.02 s: %.6e m/s\n", particle[0].velocity[2]);
        }
    }
    if (!alone) {
        double mean = 0.0;
        must(turbid_get_particles(fluid, particle, spheres));
        for (size_t i = 0; i < spheres; i++) {
            mean += particle[i].velocity[2] / (double)spheres;
        }
        printf("mean velocity of %zu spheres after %ld steps: %.6e m/s; a step takes %.1f ms, %.1f of them in the DEM\n", spheres,
               steps, mean, 1e3 * (now() - start) / (double)steps, 1e3 * in_dem / (double)steps);
    }
    free(body);
    free(particle);
    free(load);
    free(force);
    return turbid_close(fluid) == TURBID_OK ? 0 : 1;
}
