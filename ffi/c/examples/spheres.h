/* Spheres with linear springs and dashpots, without friction: the DEM of the examples. */

#ifndef SPHERES_H
#define SPHERES_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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

/* Room for `count` things of `size` bytes. */
static void *room(size_t count, size_t size) {
    void *made = calloc(count > 0 ? count : 1, size);
    if (made == NULL) {
        exit(1);
    }
    return made;
}

/* Contact force (N) of the other spheres, of which there are `count`, and of the walls on sphere `i`. */
static void contacts(size_t i, const turbid_particle *p, const turbid_body *body, size_t count, const turbid_info *info,
                     double force[3]) {
    double size[3];
    for (int k = 0; k < 3; k++) {
        size[k] = (double)info->cells[k] * info->dx;
        double low = body[i].radius - p[i].position[k], high = low + 2.0 * p[i].position[k] - size[k];
        force[k] = 0.0;
        if (info->periodic[k] == 0 && low > 0.0) {
            force[k] += fmax(0.0, STIFFNESS * low - DAMPING * p[i].velocity[k]);
        } else if (info->periodic[k] == 0 && high > 0.0) {
            force[k] -= fmax(0.0, STIFFNESS * high + DAMPING * p[i].velocity[k]);
        }
    }
    for (size_t j = 0; j < count; j++) {
        double n[3], distance = 0.0, approach = 0.0, reach = body[i].radius + body[j].radius;
        for (int k = 0; k < 3; k++) {
            n[k] = p[i].position[k] - p[j].position[k];
            if (info->periodic[k]) { /* the nearest image */
                n[k] -= size[k] * rint(n[k] / size[k]);
            }
            distance += n[k] * n[k];
        }
        if (j == i || distance >= reach * reach) {
            continue;
        }
        distance = sqrt(distance);
        for (int k = 0; k < 3; k++) {
            n[k] /= distance;
            approach -= n[k] * (p[i].velocity[k] - p[j].velocity[k]);
        }
        double push = fmax(0.0, STIFFNESS * (reach - distance) + DAMPING * approach);
        for (int k = 0; k < 3; k++) {
            force[k] += push * n[k];
        }
    }
}

/* Moves a sphere by a sub-step under a contact force and the load of the fluid, semi-implicitly. */
static void move(turbid_particle *p, const turbid_body *body, const double force[3], const turbid_load *load,
                 const turbid_info *info) {
    double dt = info->time_step / SUBSTEPS;
    for (int k = 0; k < 3; k++) {
        double acceleration = (force[k] + load->force[k]) / body->mass + info->gravity[k];
        p->velocity[k] += dt * acceleration;
        p->position[k] += dt * p->velocity[k];
        p->angular_velocity[k] += dt * load->torque[k] / body->moments[k];
    }
}

#endif
