/* section: always */
component @stem@ "Kinematics of $name";
pin out s32 status = 0 "What the last step of the inverse kinematics returned: 0 is ok";
/* section: rest */
modparam int compensate = 0 "1: joints stand where the machine, at rest under its loads, has its tool at the wanted place";
/* section: always */
option period no;
function report "Copies the status to its pin";
license "GPL";
author "kinetostat";
;;

$note
/* Axes of LinuxCNC, in mm and degrees:
$axes
   Joints, in mm and degrees:
$joints*/
#include "rtapi_math.h"
#include "kinematics.h"

$library
static const double JOINT_UNITS[MACHINE_ACTUATORS] = {$joint_units};
static int last_status;

FUNCTION(report)
{
    status = last_status;
}

static void take_axes(const EmcPose *world, double *in)
{
$from_axes}

/* section: forward */
static void give_axes(const double *in, EmcPose *world)
{
$to_axes}

/* section: always */
static int joints_at(const double *in, double *coordinates)
{
/* section: rest */
    if (compensate) {
        return machine_command(in, coordinates);
    }
/* section: always */
    return machine_actuators(in, coordinates, 0);
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);

KINEMATICS_TYPE kinematicsType(void)
{
    return $type;
}

int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{
    double in[MACHINE_INPUTS], coordinates[MACHINE_ACTUATORS];
    (void)iflags;
    (void)fflags;
    take_axes(world, in);
    last_status = joints_at(in, coordinates);
    if (last_status != MACHINE_OK) {
        return -1;
    }
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        joints[k] = coordinates[k] * JOINT_UNITS[k];
    }
    return 0;
}

int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{
    (void)fflags;
    (void)iflags;
/* section: forward */
    double in[MACHINE_INPUTS], coordinates[MACHINE_ACTUATORS];
    take_axes(world, in);
    for (int k = 0; k < MACHINE_ACTUATORS; k++) {
        coordinates[k] = joints[k] / JOINT_UNITS[k];
    }
    if (machine_forward(coordinates, in) != MACHINE_OK) {
        return -1;
    }
/* section: loaded_forward */
    /* The pose whose command these joints are: by as much as the pose of its command differs from theirs, it is moved. */
    if (compensate) {
        double free[MACHINE_INPUTS], commanded[MACHINE_INPUTS], command[MACHINE_ACTUATORS];
        for (int k = 0; k < MACHINE_INPUTS; k++) {
            free[k] = commanded[k] = in[k];
        }
        for (int step = 0; step < $steps; step++) {
            if (machine_command(in, command) != MACHINE_OK || machine_forward(command, commanded) != MACHINE_OK) {
                return -1;
            }
            for (int k = 0; k < MACHINE_INPUTS; k++) {
                in[k] += free[k] - commanded[k];
            }
        }
    }
/* section: forward */
    give_axes(in, world);
    return 0;
/* section: no_forward */
    (void)joints;
    (void)world;
    return -1;
/* section: always */
}
