/* SPDX-License-Identifier: GPL-3.0-or-later
 * The part of the plug-ins' C surface that belongs to motion: names and
 * signatures that plug-ins call through chelper.get_ffi(). */
#include <stddef.h>

#include "kin_extruder.h"
#include "kin_linear.h"
#include "motionlock.h"
#include "trapq.h"

/* Same layout as struct trap_record. */
struct pull_move {
    double print_time, move_t;
    double start_v, accel;
    double start_x, start_y, start_z;
    double x_r, y_r, z_r;
};
_Static_assert(sizeof(struct pull_move) == sizeof(struct trap_record),
               "plug-ins see trap_record as pull_move");

struct trapq *trapq_alloc(void);
void trapq_free(struct trapq *tq);
void trapq_append(struct trapq *tq, double print_time, double accel_t,
                  double cruise_t, double decel_t, double start_pos_x,
                  double start_pos_y, double start_pos_z, double axes_r_x,
                  double axes_r_y, double axes_r_z, double start_v,
                  double cruise_v, double accel);
void trapq_finalize_moves(struct trapq *tq, double print_time,
                          double clear_history_time);
int trapq_extract_old(struct trapq *tq, struct pull_move *p, int max,
                      double start_time, double end_time);
struct itersolve *cartesian_stepper_alloc(char axis);
struct itersolve *extruder_stepper_alloc(void);

struct trapq *
trapq_alloc(void)
{
    return trapq_new();
}

void
trapq_free(struct trapq *tq)
{
    trapq_delete(tq);
}

void
trapq_append(struct trapq *tq, double print_time, double accel_t,
             double cruise_t, double decel_t, double start_pos_x,
             double start_pos_y, double start_pos_z, double axes_r_x,
             double axes_r_y, double axes_r_z, double start_v,
             double cruise_v, double accel)
{
    struct trap_move move = {
        .accel_t = accel_t, .cruise_t = cruise_t, .decel_t = decel_t,
        .start = { start_pos_x, start_pos_y, start_pos_z },
        .axes_r = { axes_r_x, axes_r_y, axes_r_z },
        .start_v = start_v, .cruise_v = cruise_v, .accel = accel,
    };

    motionlock_take();
    (void)trapq_add(tq, print_time, &move);
    motionlock_give();
}

void
trapq_finalize_moves(struct trapq *tq, double print_time,
                     double clear_history_time)
{
    motionlock_take();
    trapq_finalize(tq, print_time, clear_history_time);
    motionlock_give();
}

int
trapq_extract_old(struct trapq *tq, struct pull_move *p, int max,
                  double start_time, double end_time)
{
    int count;

    motionlock_take();
    count = trapq_extract(tq, (struct trap_record *)p, max, start_time,
                          end_time);
    motionlock_give();
    return count;
}

/* Both may be freed by free(). */
struct itersolve *
cartesian_stepper_alloc(char axis)
{
    struct kin_linear *k = kin_linear_new(axis == 'x', axis == 'y',
                                          axis == 'z');

    return k ? &k->is : NULL;
}

struct itersolve *
extruder_stepper_alloc(void)
{
    struct kin_extruder *k = kin_extruder_new();

    return k ? &k->is : NULL;
}
