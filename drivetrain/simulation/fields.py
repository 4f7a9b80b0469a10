"""Where the compiled engines find what: the header of ``words``, the fields of ``signals``, rows of vectors.

``numbers`` holds all real numbers of a run, ``words`` all whole ones; the header of ``words`` says where each part
begins. Fields of signals hold one number a joint: field times number of joints plus index of the joint.
"""

from __future__ import annotations

# Header of words: sizes; of the states the first ``MOVING`` are those that an engine hands over, the others stay in the
# numbers, as only samples and accounts change them.
JOINTS, COORDINATES, STATES, MOVING, SIGNALS, KIND, SPINS = range(7)
# Places in numbers.
AT_STATE, AT_RATES, AT_SIGNALS, AT_TURNED, AT_WORK, AT_WORK_ROWS, AT_ROWS, AT_ROW_COUNT, AT_RATIOS = range(7, 16)
AT_MATRIX, AT_REDUCED, AT_CARRIED, AT_VECTORS, AT_LEVELS, AT_ENERGIES, AT_CONSTANT = range(16, 23)
# Places in words: which coordinate a joint's motor has (-1: none), modes of friction, which own states are signals.
AT_SPINS, AT_MOTORS, AT_MODES, AT_SIDES, AT_FIXED, AT_SHOWN, SHOWN = range(23, 30)
# Calls: how many, and where their table begins (address, place of the rows in words; for samples a place of the period
# in numbers and the count of samples taken).
COMPUTES, AT_COMPUTES, ACCOUNTS, AT_ACCOUNTS, SAMPLES, AT_SAMPLES = range(30, 36)
# Signals: places of the mass matrix, of the first and behind the last that is added to; powers to sum up.
AT_MASS, ADDED_FROM, ADDED_TO, POWERS, AT_POWERS, TIP, AT_TIP, AT_TIP_TAKEN, HELD_MODES = range(36, 45)
NUMBERS, WORDS, RATES_CALLS, AT_TIP_SIGNALS = range(45, 49)
# Addresses of the compiled equations, what they came to (as ``solve_friction`` tells), where theta stands;
# and whether springs or dampers made the last step's inertia a good deal larger.
MOTION, FORCES, SOLVED, AT_THETA, AT_SPARE, STIFF, AT_ENERGY_SIGNALS = range(49, 56)
# Payloads: how many entries of instant and ten numbers of the last link, and where they begin.
PAYLOADS, AT_PAYLOADS = range(56, 58)
# Laws of gears and of the tip's surroundings that bend within a step, called again until the step agrees with them
# (0: none); six numbers a coordinate, between which rates a spring's has been tried; steps that never agreed.
REPEATS, AT_REPEATS, AT_TRIED, UNSETTLED = range(58, 62)
# Coupled motors: whether there are any; joints' motion from that of the coordinates, (n, n), a flag a joint; bodies'
# coordinates (joints, rotors on their own, rotors that follow several joints) and what of the turning of each
# coordinate a motor feels: index of a body's coordinate and factor; inertia of reflected rotors at their shafts.
COUPLED, AT_TURNS, AT_BOUND, BODIES, AT_BODIES, AT_SPREAD, AT_FELT, AT_FACTORS, AT_OWN = range(62, 71)
HEADER = 71

# Fields of signals, in the order of ``effects.signals``: known before, told after, taken by the mechanics.
POSITION, SPEED, MOTOR_POSITION, MOTOR_SPEED, DEFLECTION, DEFLECTION_SPEED, BIAS_TORQUE = range(7)
ACCELERATION, MOTOR_ACCELERATION, JOINT_FRICTION, MOTOR_FRICTION, MESH_TORQUE, MESH_LOSS = range(7, 13)
JOINT_FRICTION_POWER, MOTOR_FRICTION_POWER, MESH_POWER = range(13, 16)
JOINT_TORQUE, JOINT_DAMPING, JOINT_STIFFNESS, MOTOR_TORQUE, MOTOR_DAMPING, MOTOR_STIFFNESS = range(6)
GEAR_TORQUE, GEAR_DAMPING, GEAR_STIFFNESS, JOINT_LEVELS, MOTOR_LEVELS = 6, 7, 8, 9, 13
MESH_DRIVING, MESH_DRIVEN, SURFACE_SPEED = range(17, 20)
FIELDS_GIVEN, FIELDS_TAKEN = 16, 20
# Where a motor drives several joints a joint has no spring: the shaft behind its gear takes the spring's fields.
SHAFT_POSITION, SHAFT_SPEED = DEFLECTION, DEFLECTION_SPEED
SHAFT_TORQUE, SHAFT_DAMPING, SHAFT_STIFFNESS = GEAR_TORQUE, GEAR_DAMPING, GEAR_STIFFNESS

# Rows of the vectors, one number a coordinate.
BIAS, TURNED_BIAS, GUESS, LAST, RIGHT, CHANGE, RELATIVE, CARRIED, FRICTION, MARGIN, SMOOTH = range(11)
PLACES, SURFACE, TRIAL = range(11, 14)
VECTORS = 14
# Levels of friction, a row a coordinate: joint side hold forward, backward, slide forward, backward; motor side the
# same; mesh driving, driven; whether there is any.
HOLD, SLIDE, MOTOR, DRIVING, DRIVEN, ACTIVE = 0, 2, 4, 8, 9, 10
LEVELS = 11

# Of the tip: its frame in the last link's, place, speed and turning at the guess, the force that a solution expects,
# and how forces fell with speed and place when last asked.
TIP_PLACE, TIP_SPEED, TIP_TURNING, TIP_EXPECTED, TIP_SOFT, TIP_NUMBERS, TIP_FORCES = 16, 19, 22, 25, 28, 40, 18

# Constants of a scene without an arm, a row each: inertia, torque of the weight along x, angle from x, rotor's inertia.
INERTIA, WEIGHT, PHASE, EXTRA = range(4)

# Kinds of mechanics.
CONSTANT, ARM = range(2)
