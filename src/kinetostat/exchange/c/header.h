/* section: always */
$note
#ifndef MACHINE_H
#define MACHINE_H

/* Arguments and results are of this type: compile with -DMACHINE_REAL=float for another one. Arithmetic stays double,
   because legs are judged to close, and machines to be singular, to ten digits. */
#ifndef MACHINE_REAL
#define MACHINE_REAL double
#endif
typedef MACHINE_REAL machine_real;

#ifdef __cplusplus
extern "C" {
#endif

enum { $sizes };

/* What functions return. All results but those of MACHINE_OK are NaN.
$sentences */
enum { $statuses };

/* Functions take the coordinates of the pose, and parameters after them:
$given   Actuators, in this order:
$driven   No function allocates memory or keeps anything between calls, so that threads may call them at once. */

/* Stiffness K and compliance C at the tool point, rows rx ry rz x y z in axes of the base, SI, row by row; infinite
   where the machine is rigid or free. $entries_at operations. */
int machine_matrices(const machine_real in[], machine_real stiffness[36], machine_real compliance[36]);

/* Coordinates of the actuators, and unless slopes is a null pointer, their derivatives by all inputs
   [MACHINE_ACTUATORS x MACHINE_INPUTS]. $actuators_at operations; $actuator_slopes_at with slopes. */
int machine_actuators(const machine_real in[], machine_real coordinates[], machine_real *slopes);
/* section: forward */

/* The pose at which the actuators stand at given coordinates. The search begins at the pose in `in`, by which it is
   replaced; start at the pose before. At most $forward operations. */
int machine_forward(const machine_real coordinates[], machine_real in[]);
/* section: rest */

/* How far the tool of the machine, which is at the pose without loads, is displaced when it is at rest under its loads:
   rotation vector (rad) and displacement of the tool point (m) in axes of the base. At most $rest operations. */
int machine_rest(const machine_real in[], machine_real displacement[6]);

/* Coordinates of the actuators with which the loaded tool is at the pose, or as near as the machine can bring it.
   At most $command operations. */
int machine_command(const machine_real in[], machine_real coordinates[]);
/* section: quantities */

/* Quantities, in SI, and unless slopes is a null pointer, their derivatives by all inputs
   [MACHINE_QUANTITIES x MACHINE_INPUTS], NaN where a quantity is infinite:
$listed   $quantities_at operations; $quantity_slopes_at with slopes.$before */
int machine_quantities(const machine_real in[], machine_real quantities[], machine_real *slopes);
/* section: always */

#ifdef __cplusplus
}
#endif
#endif
