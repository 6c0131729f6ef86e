"""Numerical tolerances of the whole package, named by what they mean.

No sizes, counts or limits of display live here, only numbers that decide when two floating-point results count as the
same, when something counts as zero, and when an iteration has converged. Each says why it has its value.
"""

# Divisions

LEAST_DIVISOR = 1e-300
"""Number that stands for zero where a size is divided by, or compared with the largest of its kind: all sizes of which
some are zero then need no case of their own, and no size of a machine, in any unit, is nearly as small. It is a hundred
million times the least number of floating point with all digits, so that quotients of it are finite or 0."""

# Limits of machines

LIMIT_SLACK = 1e-9
"""Share of its scale by which a measure may pass a limit that still counts as kept: so that a pose that was computed to
lie exactly at its limit is not refused by round-off, and yet far below what anyone can measure on a machine."""

# Files

ROUND_OFF_OF_INERTIA = 1e-4
"""Share of its largest entry by which an inertia tensor may be impossible, because files give a few digits."""
SAME_MATTER = 1e-9
"""Relative difference up to which numbers of two cross-sections are one: units and decimals of a file round them."""
NO_AXIS = 1e-9
"""Length of an axis, as a number or in m, below which it has no direction: nobody writes an axis so short."""
PARALLEL_IN_FILE = 1e-6
"""Sine of the angle between directions below which a file that wants two of them has written one: files have about six
digits."""
SYMMETRIC = 1e-9
"""Relative difference up to which a compliance matrix counts as symmetric and as free of negative eigenvalues."""
SIMPLE_COSINE = 1e-15
"""Distance from 0, 1/2 or 1 at which a cosine or sine is meant to be that number: multiples of 30 deg are exact."""

# Exchange with other programs

ROUND_OFF_OF_COUPLING = 1e-14
"""Share of the root of two diagonal entries of K below which the entry that couples them is written as 0."""
COINCIDENT_HINGES = 1e-9
"""Distance, m, below which hinges of a chain lie at one point and become one joint or share a body."""
INDEPENDENT_AXES = 1e-6
"""Volume or area spanned by unit axes of a URDF below which one of them depends on the others."""
OPEN_LOOP = 1e-6
"""Gap, m, or angle, rad, of a URDF's loop above which it is open: files have about this many digits."""
EVEN_CHORDS = 1e-9
"""Relative difference of chords up to which they belong to one arc: far above round-off, far below what is visible."""
OPEN_CASCADE_POINT = 1e-7
"""Distance of points that Open CASCADE takes for one, mm (its own default precision)."""
SOFT_CONSTRAINT = 1e-6
"""Compliance of a MuJoCo constraint as a share of the machine's; a dozen constraints add up to about 1e-5."""
RIGID_BLOCK = 1e-9
"""Share of the other diagonal block of C below which a block counts as rigid."""

# Kinematics: joints that close the legs

CLOSED = 1e-10
"""Largest gap of a closed leg or a reached pose, rad or in units of the machine's length: far above round-off, far
below what a micrometre is to a machine of a metre."""
NEWTON_SETTLED = 1e-14
"""Gap, in the same units, at which nothing but round-off is left and Newton's method ends."""
LEAST_GAP_SETTLED = 1e-6
"""Slope of the squared gap, as a share of the gap, at which it has its least value: half of the digits
are lost there."""
NO_CONTRACTION = 1e-7
"""Size of a correction, rad or in units of the machine's length, below which the next one shows no contraction: it is
the square of this, which is round-off."""
NO_CURVATURE = 1e-12
"""Cosine between a step and the change of slope along it below which that change is round-off and says nothing."""
NEAREST_GAIN = 1e-10
"""Share of its square by which a squared distance could still become less where the nearest pose is reached: it
is written in five digits, and the step that would do so is still taken."""
SURELY_APART = 1e-9
"""Share of the machine's length by which a leg must miss its platform, so that this shows it to be out of reach."""
SAME_CENTRE = 1e-9
"""Distance, m, below which the centres of joints in a row coincide as written in a file."""
SAME_DIRECTION = 4e-15
"""Sine of an angle, or cosine of one from a right angle, that is the round-off of directions as written in a file."""
LEAST_NORM_DAMPING = 1e-15
"""Damping as a share of the trace of the squared rates: far below what a regular direction weighs, enough for a joint
coordinate that moves nothing."""
IDLE_FREEDOM = 1e-9
"""Relative singular value below which joints of closed legs move without changing any gap."""
NEAREST_POSTURE = 1e-13
"""Slope of half the squared distance of joints from home along idle motions at which nothing but round-off is left."""
NO_ANGLE_RATES = 1e-9
"""Relative singular value below which roll and yaw have no separate rates (at pitch = +-90 deg)."""
ROUNDED_ORIENTATION = 1e-3
"""Error of a quaternion or a rotation matrix that is accepted: that of numbers rounded to three digits."""
UNDETERMINED = 1e-4
"""Share of undamped motion above which nothing but the damping determines where the platform is."""
ONE_PLACEMENT = 1e-5
"""Distance of two solutions of forward kinematics, rad and in units of the machine's length, up to which they are one:
near a double solution each comes out in half of the digits."""
UNDRIVEN = 1e-9
"""Share of the largest rate below which joints that are not driven change no equation."""
NO_COORDINATE = 1e-9
"""Coordinates of a pose below this, m or rad, are round-off of zero when they are offered to a reader."""
PURE_TRANSLATION = 1e-9
"""Share of rotation below which a twist counts as a translation without rotation."""
SEEN_BY_LEG = 1e-7
"""Share of the largest singular value of a leg's freedoms, and of the effect of an error, below which it is round-off:
at random places of a leg nothing is nearly dependent without being so by form."""
NEARLY_DEPENDENT = 1e-4
"""Share of the largest pivot of a leg's freedoms below which steps are taken by singular values: squares of the
freedoms, which are faster, keep eight digits of a step above it, and the next step brings the others."""
DEPENDENT = 1e-6
"""Singular value of unit screws below which they are dependent: half of the digits are lost in a square root."""
SINGULAR_LEG = 1e-6
"""Determinant of the twists of a leg's joints, in rad and in units of the machine's length, up to which the leg counts
as singular and has no assembly mode. It is the product of all singular values: several that are merely small also make
it so, and then any solution of the leg is taken."""
NEGLIGIBLE_COMPONENT = 1e-9
"""Share of a screw's largest component below which another one is round-off and is not written out."""
PARALLEL_AXES = 1e-12
"""Sine of the angle between axes up to which they are parallel as written in a file. Where a cosine is compared with 1,
which has half of the digits, axes are parallel up to a sine of 1.4e-6: there it says only what a number is called."""
ONE_PLACE = 1e-12
"""Share of the distance of joints from the origin of the base below which they lie at the platform point P: what is
left of points that coincide, once they have been turned."""
LEAST_LENGTH = 1e-15
"""The same, m, where that point is the origin itself, as far as the machine knows: smaller than an atom."""
NO_LINK = 1e-9
"""Length of a link, m, below which it has no direction."""
SAME_RAY = 1e-9
"""Sine of the angle between two rays below which an arc from one to the other is straight, and turns about no axis."""

# Errors of the tool by tolerances

NO_REACTION = 1e-9
"""Share of the load, moments over the machine's length, below which the reaction of a joint is round-off, so that the
load does not say to which end it presses the free motion of the joint."""
NO_EFFECT = 1e-12
"""Share of what an error does to the tool, rotations times the machine's length, below which a part is round-off."""
NO_FREEDOM = 1e-7
"""Share of the largest singular value of the rates of all actuators below which they do not move the platform so."""

# Equilibrium under load

OPEN_BY_STEP = 30.0
"""Times the gap of the closing equations up to which conditions are dependent: Newton's steps open legs by the square
of their length, and the screws of redundant legs then differ by some of that."""

AT_REST = 1e-10
"""Motion in one of Newton's steps, rad or in units of the machine's length, below which steps converge quadratically or
are round-off: the next one is the square of it."""
ROUND_OFF_AT_REST = 1e-13
"""Motion below which a step is not taken, in the same units: Newton's method foresees how long its next step is."""
ONE_STEP_AWAY = 1e-7
"""Size of a step of a program, in the same units, after which another one is exact to round-off: its square is."""
LAST_STEP = 1e-12
"""Size of such a step up to which the stiffness is the same before and after it: that of slender machines changes by a
thousand times as much as their shape."""

NEARLY_AT_REST = 1e-6
"""Step of a descent, in the same units, from which Newton's steps take over: half of the digits, as far as differences
of a potential tell one state from another."""
UNMOVED_TOOL = 1e-13
"""Displacement, rad or in units of the machine's length, below which the tool of a loaded machine has not moved: a
tenth of a picometre of a metre, and what round-off leaves of a rigid machine."""
BALANCED = 1e-9
"""Share of the load that may be left over where tensions are chosen: least squares keep some twelve digits."""
SAME_FORCE = 1e-13
"""Share of the largest of the forces that are distributed below which a step of them is round-off."""
INDEPENDENT_CONDITION = 1e-20
"""Square of the share of a condition's normal below which other conditions leave nothing of it."""
HANGING = 1e-13
"""Share of a cable's length below which a step towards its shape is round-off; as level a cable hangs straight down."""
SURELY_HANGING = 1e-10
"""The same below which the shape is good after the last step that was allowed, with three digits less."""
SETTLED_CABLE = 1e-13
"""Change of a cable's direction, or of where it leaves its pulley, m, below which it is round-off."""
SURELY_SETTLED_CABLE = 1e-7
"""The same below which a cable has settled after the last step that was allowed: steps that shrink slowly have then
left half of the digits, and cables that swing between two shapes change by far more."""
DEGENERATE_FACE = 1e-10
"""Product of unit wrenches below which they are dependent and span no face: their round-off is then its direction."""
SURELY_REGULAR = 1e-6
"""Share of the largest pivot of conditions above which all of them are surely independent, and reflections without
exchanges keep ten digits; singular values decide below it."""
ACCURACY_OF_SHARE = 1e-3
"""Relative accuracy of the share of the loads under which a machine gives way: people are shown three digits."""
STIFFEST_LEG = 1e6
"""Stiffness of a leg, in units of the typical one of the machine's springs, and beside the softest direction of all
legs together, beyond which it counts as rigid where legs are eliminated: the sum of all legs keeps ten digits."""
UNRESISTED = 1e-12
"""Share of the largest singular value or stiffness below which a motion meets no condition, or no spring."""

SURE_PIVOT = 1e-9
"""Share of a diagonal entry below which its pivot says too little about stability."""

COMMANDED = 1e-14
"""Change of an actuator, rad or in units of the machine's length, below which a correction is round-off."""
EXACT_LAW = 1e-9
"""Share of the largest correction below which a coefficient, or the error of a law, is round-off of the states of rest
that the law was fitted to."""

# Engine: derivatives

SAME_DERIVATIVE = 1e-6
"""Relative difference up to which two ways to a derivative agree: both keep some nine digits near regular poses, and
a closed form that does not hold differs in the first."""
ROUND_OFF_DERIVATIVE = 1e-9
"""Share of the largest derivative below which another one may be round-off."""
IDLE_COORDINATES = 1e-9
"""Relative singular value below which a combination of joint coordinates does not change the closing equations."""
OPENING = 1e-8
"""Share of an equation's largest rate beyond which it cannot be satisfied when a parameter changes alone: a leg would
open."""

# Pictures

SAME_TO_THE_EYE = 1e-6
"""Distance of two points, m, and sine of an angle, below which a picture shows them as one: joints that meet do so up
to round-off, and nobody sees a micrometre."""
NO_DIRECTION = 1e-9
"""Size of a vector, relative to those it is made of, below which its direction is round-off."""
NO_CIRCLE = 1e-9
"""Radius, relative to the largest of a solid, below which a circle is drawn as a point: sin(pi) leaves 1e-16."""
NO_TURN = 1e-12
"""Angle, rad, below which a body is drawn without turning: the axis of a smaller turn is round-off."""

# Studies

ROUND_OFF_OF_SHARE = 1e-12
"""Difference of a share from the one that is asked for, or size of an entry of a unit vector, that is round-off."""
NO_ROLE = 1e-9
"""Share of an entry of C or K below which an element has no part in it: its contribution is then round-off."""
NO_INFLUENCE = 1e-9
"""Percent per percent below which a parameter has no influence: exact derivatives of zero come out at 1e-13 or less."""
ZERO_LENGTH = 1e-9
"""Share of the characteristic length below which a length counts as zero, and no percent of it means anything."""
ROUND_OFF_OF_ENTRY = 1e-12
"""Share of what an entry of a screw, of K or of C is compared with below which it is only round-off."""
ROUND_OFF_OF_COLUMN = 1e-10
"""Share of the greatest value of a printed column below which a value of the same unit is round-off: states of rest
leave some 1e-12 of the load, and nobody needs two numbers of one column that are ten decades apart."""
EQUAL_DESIGNS = 1e-9
"""Relative difference up to which a number is the same for two designs, so that neither is the better one."""
EQUAL_ROUTES = 1e-9
"""Relative difference up to which machine code, NumPy and a single pose agree in the self-test."""

# Identification

FIT_SETTLED = 1e-10
"""Relative change of the sum of squares, and of the unknowns, below which a fit has settled: a thousandth of what tells
two fits apart, also where steps along a curved valley are many."""
FIT_BEGUN = 1e-3
"""The same of fits that only say how far the residuals spread, because the next one starts from there."""
ON_A_LINE = 1e-10
"""Share of the largest singular value of the products of two sets of positions below which these lie on a line: each
then lies beside it by less than 1e-5 of its length, and how one is turned about it against the other is noise."""
FITTED_COMPLIANCE = 1e-12
"""Relative difference of a compliance by fitted values of the file from the one that was found that is round-off."""
ROUND_OFF_OF_MEASUREMENT = 1e-9
"""Residual, rad or as a share of the machine's length, up to which it may be round-off of the file or of the model: no
value is an outlier by it, and no interval is shorter."""

# Validation with independent engines

AGREED = 1e-6
"""Relative difference up to which two compliances agree: engines with their own tolerances reach about 1e-8."""
RIGID_BLOCK_OF_ENGINE = 1e-10
"""Share of the other diagonal block of C, in one unit, below which it counts as zero: the machine is rigid there."""
BLOCK_BEING_EXTRAPOLATED = 1e-4
"""The same while a block of a rigid machine is still on its way to zero, so that its relative error means nothing."""
COINCIDENT = 1e-9
"""Share of a leg's extent, or sine of an angle, below which points coincide and directions are parallel."""
UNBALANCED_LOAD = 1e-6
"""Share of a load that may remain where a singular system is solved by least squares; more means a free motion."""
IDLE_MOTION = 1e-15
"""Relative stiffness below which a motion counts as idle: the round-off of the largest stiffness."""
NO_MOMENTUM = 1e-14
"""Share of all mass, moving as far as the softest motion, below which the mass of a motion is what round-off leaves
where parts without stiffness have taken all momentum."""
MASSLESS_MODE = 1e-9
"""Square of a frequency ratio: a mode this much faster than the first one is a motion without mass, by round-off."""
UNMOVED = 1e-9
"""Share of the largest motion below which a wrench moves nothing."""
NEWTON_STATICS = 1e-9
"""Relative tolerance of Newton's method in the engine's nonlinear statics."""
SAME_NODE = 1e-6
"""Share of the machine's length below which two points of a frame are one node."""

# Algebra

PARALLEL_SEGMENTS = 1e-14
"""Square of the sine of the angle between two segments below which they count as parallel: 1e-7 of an angle, where the
common perpendicular has lost half of its digits and any point serves."""
ZERO_PIVOT = 1e-100
"""Size below which a pivot counts as zero: the square of its inverse would overflow soon after."""

# Statics of machines

SINGULAR = 1e-6
"""Singularity margin below which a pose counts as singular: results have then lost six of their digits. A leg exactly
at its limit comes out at the square root of a few units of round-off, 1e-8 to 3e-7, not at zero."""
FREE_COMPONENT = 1e-5
"""Component of a unit free twist below which it is none: a pose within `SINGULAR` of a singularity has free twists that
are known to about as many digits."""
MOST_LEG_CONTRAST = 1e12
"""Condition number of a leg's flexibility beyond which the leg counts as rigid against some load, at singular poses."""
CLOSING_ROUND_OFF = 1e-9
"""Share of a unit screw, or of the load that it can exert on a spring, below which the rest is round-off: legs close up
to `CLOSED`, and their condition costs a digit. Away from home, rigid parts that hold the same motion differ by some
1e-12, and C would be wrong if that counted."""
SURELY_MORE = 1e-6
"""The same share above which it is surely more. Between the two nobody can say whether rigid parts share a load, and
the answer says so; of a thousand random poses none lies there."""
LEAST_LOAD_OF_DRIVE = 1e-100
"""Load of a drive per unit of a wrench that stands for 0 where its reciprocal is a wrench: far below every load that is
not 0, and so large that the squares of its reciprocal are finite."""
UNREACHED_COMPONENT = 1e-18
"""Square of `CLOSING_ROUND_OFF`: share of the squared size of a screw below which a rigid or free spring does not reach
along a component. Without it, round-off times infinity would make entries of K or C infinite."""
UNFELT = 1e-11
"""Share of the load that a spring can have per unit load of the platform below which what it adds to C is round-off:
legs that share a load by least energy leave some 1e-12 of it in a spring that should feel nothing."""
SAME_VERTEX = 1e-10
"""Share of the size of a polytope within which two vertices are one, and of a slope below which a face is not met."""
DEPENDENT_GENERATORS = 1e-9
"""Determinant of orthonormal internal loads in some drives below which these are dependent: the face that they would
make of a set of wrenches is one that others make, or none."""
DEPENDENT_LOADS = 1e-12
"""Sine of the angle between the loads of a leg's springs below which they are dependent up to round-off."""
DEPENDENT_WRENCHES = 1e-9
"""Relative singular value below which wrenches of legs are dependent, where internal loads are counted."""
ROUND_OFF_OF_ELEMENT = 1e-12
"""Share of what an element adds to an entry of C below which what the other elements add is only round-off."""
ROUND_OFF_OF_COMPLIANCE = 1e-20
"""Square of `CLOSED`: share of the other diagonal entries of C, made comparable by the length of the machine, below
which one of them is the square of a rounding error and stands for 0."""
ROUND_OFF_OF_EIGENVALUE = 1e-14
"""Share of the largest eigenvalue or singular value below which one stands for 0: some dozen units of round-off."""
ROUND_OFF_OF_BLOCK = 1e-14
"""Share of the trace of a block of a link's compliance below which a principal compliance is round-off, and rigid."""
NO_PITCH = 1e-12
"""Share of what a unit turn moves below which the pitch of its screw is round-off."""
ROUND_OFF_OF_COMPLEMENT = 1e-12
"""The same share after the subtraction in a Schur complement, which loses two more digits."""
LARGEST_FREE = 1e-7
"""Share of the largest stiffness that round-off may leave of a direction known to be free; springs of one machine that
are farther apart are told from none."""
EQUAL_STIFFNESSES = 1e-9
"""Relative difference of principal stiffnesses below which they are equal, and their directions are arbitrary."""
EQUAL_FREQUENCIES = 1e-6
"""Relative difference of natural frequencies below which their modes are told together: a loaded state is not found to
the last digit, and no measurement could part such modes."""
AT_RIGHT_ANGLES = 1e-9
"""Cosine below which a direction is at right angles to a principal one. Without it, a direction that is rigid or free
would decide the stiffness along all others."""
NO_UNIQUE_CENTRE = 1e-12
"""Ratio of eigenvalues below which the equation of a centre is singular, so that the centre is not unique."""
ZERO_EIGENSCREW = 1e-12
"""Share of the largest eigenvalue, in units of the matrix' own length, below which an eigenvalue stands for 0."""
PURE_COUPLE = 1e-9
"""Share of force in a wrench (rotation in a twist), in the same units, below which it is a couple (a translation)."""
