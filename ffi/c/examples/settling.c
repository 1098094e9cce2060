/* A DEM of its own drives Turbid as its fluid: spheres settle, hit the floor and come to rest on it and on each other.
 *
 * Contacts are linear springs with dashpots, without friction, of all pairs. A step of the fluid gives the loads for the states that
 * were set last; the DEM then moves the spheres under these loads and their weight, in sub-steps that resolve a contact.
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

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <turbid.h>

#define SUBSTEPS 20

static const char *CASE =
    "domain = { size = [4e-3, 4e-3, 6e-3], periodic = [true, true, false] }\n"
    "fluid = { density = 1000.0, viscosity = 1e-5 }\n"
    "lattice = { cells_per_diameter = 4, relaxation_time = 0.6 }\n"
    "run.end.time = 0.2\n"
    "[[particles]]\n"
    "shape.sphere.diameter = 1e-3\n"
    "density = 2500.0\n"
    "list = [[2e-3, 2e-3, 4e-3], [2.2e-3, 2e-3, 1.5e-3], [2e-3, 2.2e-3, 2.8e-3]]\n";

/* Stiffness (N/m) and damping (N s/m) of a contact. */
static const double STIFFNESS = 50.0, DAMPING = 5e-3;

/* Ends the program with the message of a call that has failed. */
static void must(int code) {
    if (code != TURBID_OK) {
        fprintf(stderr, "error %d: %s\n", code, turbid_last_error());
        exit(1);
    }
}

/* Seconds of some clock. */
static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Room for `count` things of `size` bytes. */
static void *room(size_t count, size_t size) {
    void *made = calloc(count, size);
    if (made == NULL) {
        exit(1);
    }
    return made;
}

/* Adds the contact forces (N) on all spheres. */
static void contacts(const turbid_particle *p, const turbid_body *body, const turbid_info *info, double force[][3]) {
    double size[3];
    for (int k = 0; k < 3; k++) {
        size[k] = (double)info->cells[k] * info->dx;
    }
    for (size_t i = 0; i < info->particles; i++) {
        for (int k = 0; k < 3; k++) {
            double low = body[i].radius - p[i].position[k], high = low + 2.0 * p[i].position[k] - size[k];
            if (info->periodic[k] == 0 && low > 0.0) {
                force[i][k] += fmax(0.0, STIFFNESS * low - DAMPING * p[i].velocity[k]);
            } else if (info->periodic[k] == 0 && high > 0.0) {
                force[i][k] -= fmax(0.0, STIFFNESS * high + DAMPING * p[i].velocity[k]);
            }
        }
        for (size_t j = 0; j < i; j++) {
            double n[3], distance = 0.0, approach = 0.0, reach = body[i].radius + body[j].radius;
            for (int k = 0; k < 3; k++) {
                n[k] = p[i].position[k] - p[j].position[k];
                if (info->periodic[k]) { /* the nearest image */
                    n[k] -= size[k] * rint(n[k] / size[k]);
                }
                distance += n[k] * n[k];
            }
            if (distance >= reach * reach) {
                continue;
            }
            distance = sqrt(distance);
            for (int k = 0; k < 3; k++) {
                n[k] /= distance;
                approach -= n[k] * (p[i].velocity[k] - p[j].velocity[k]);
            }
            double push = fmax(0.0, STIFFNESS * (reach - distance) + DAMPING * approach);
            for (int k = 0; k < 3; k++) {
                force[i][k] += push * n[k];
                force[j][k] -= push * n[k];
            }
        }
    }
}

/* Moves the spheres by a time step under loads that are constant in it, semi-implicitly; `force` has room for all. */
static void move(turbid_particle *p, const turbid_body *body, const turbid_load *load, const turbid_info *info,
                 double force[][3]) {
    double dt = info->time_step / SUBSTEPS;
    for (int substep = 0; substep < SUBSTEPS; substep++) {
        memset(force, 0, info->particles * sizeof *force);
        contacts(p, body, info, force);
        for (size_t i = 0; i < info->particles; i++) {
            for (int k = 0; k < 3; k++) {
                double acceleration = (force[i][k] + load[i].force[k]) / body[i].mass + info->gravity[k];
                p[i].velocity[k] += dt * acceleration;
                p[i].position[k] += dt * p[i].velocity[k];
                p[i].angular_velocity[k] += dt * load[i].torque[k] / body[i].moments[k];
            }
        }
    }
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
            move(particle, body, load, &info, force);
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
