/* A DEM of its own drives Turbid as its fluid: spheres settle, hit the floor and come to rest on it and on each other.
 *
 * Contacts are linear springs with dashpots, without friction. A step of the fluid gives the loads for the states that were set
 * last; the DEM then moves the spheres under these loads and their weight, in sub-steps that resolve a contact. Prints
 *
 *   # time (s)  heights (mm)
 *   ...
 *   velocity of sphere 0 at 0.02 s: -3.6e-02 m/s
 */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <turbid.h>

#define SPHERES 3
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

/* The shortest image of a distance in a periodic direction. */
static double image(double distance, double length) { return distance - length * round(distance / length); }

/* Adds the contact forces (N) on all spheres. */
static void contacts(const turbid_particle *p, const turbid_body *body, const double *size, double force[][3]) {
    for (int i = 0; i < SPHERES; i++) {
        double depth = body[i].radius - p[i].position[2];
        if (depth > 0.0) {
            force[i][2] += fmax(0.0, STIFFNESS * depth - DAMPING * p[i].velocity[2]);
        }
        for (int j = 0; j < i; j++) {
            double n[3], distance = 0.0, approach = 0.0;
            for (int k = 0; k < 3; k++) {
                double d = p[i].position[k] - p[j].position[k];
                n[k] = k < 2 ? image(d, size[k]) : d;
                distance += n[k] * n[k];
            }
            distance = sqrt(distance);
            depth = body[i].radius + body[j].radius - distance;
            if (depth <= 0.0) {
                continue;
            }
            for (int k = 0; k < 3; k++) {
                n[k] /= distance;
                approach -= n[k] * (p[i].velocity[k] - p[j].velocity[k]);
            }
            double push = fmax(0.0, STIFFNESS * depth + DAMPING * approach);
            for (int k = 0; k < 3; k++) {
                force[i][k] += push * n[k];
                force[j][k] -= push * n[k];
            }
        }
    }
}

/* Moves the spheres by a time step under loads that are constant in it, semi-implicitly. */
static void move(turbid_particle *p, const turbid_body *body, const turbid_load *load, const turbid_info *info) {
    double dt = info->time_step / SUBSTEPS;
    double size[3];
    for (int k = 0; k < 3; k++) {
        size[k] = (double)info->cells[k] * info->dx;
    }
    for (int substep = 0; substep < SUBSTEPS; substep++) {
        double force[SPHERES][3] = {{0.0}};
        contacts(p, body, size, force);
        for (int i = 0; i < SPHERES; i++) {
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
    double end = count > 1 ? atof(arguments[1]) : 0.2;
    turbid_handle fluid = 0;
    must(turbid_open_text(CASE, "run.threads=1", 1, &fluid));
    turbid_info info;
    must(turbid_get_info(fluid, &info));
    if (info.particles != SPHERES) {
        return 1;
    }
    turbid_body body[SPHERES];
    turbid_particle particle[SPHERES];
    turbid_load load[SPHERES];
    must(turbid_get_bodies(fluid, body, SPHERES));
    must(turbid_get_particles(fluid, particle, SPHERES));

    printf("# time (s)  heights (mm)\n");
    long steps = lround(end / info.time_step), early = lround(0.02 / info.time_step);
    for (long step = 1; step <= steps; step++) {
        must(turbid_step(fluid, 1));
        must(turbid_get_loads(fluid, load, SPHERES));
        move(particle, body, load, &info);
        must(turbid_set_particles(fluid, particle, SPHERES));
        if (step % 96 == 0 || step == steps) {
            printf("%.4f", (double)step * info.time_step);
            for (int i = 0; i < SPHERES; i++) {
                printf("  %.4f", 1e3 * particle[i].position[2]);
            }
            printf("\n");
        }
        if (step == early) {
            printf("velocity of sphere 0 at 0.02 s: %.6e m/s\n", particle[0].velocity[2]);
        }
    }
    return turbid_close(fluid) == TURBID_OK ? 0 : 1;
}
