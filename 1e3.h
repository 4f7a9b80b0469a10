/* Currents of study, by drivetrain 0.1.0; study SHA-256 6082eb5823eb141f9db32ebd78258f966e31ede006b65261c7e106232f3a078e */
/* call x_step at 1000 Hz; payload: none */
/* q, qd, qdd: commanded position, speed, acceleration [rad or m, and per s, s^2]; measured_q, measured_qd: position and speed measured by the encoders */
/* current: output, DC-equivalent [A]; returns 0, or an error code and leaves state and current unchanged: 1: an input is not finite */
/* joints: joint_1, joint_2 */
#ifndef 1E3_H
#define 1E3_H
#define X_JOINTS 2
typedef struct {
    double current[X_JOINTS];
    double overload[X_JOINTS];
    double winding_temperature[X_JOINTS];
    double housing_temperature[X_JOINTS];
} x_state;
void x_start(x_state *s);
int x_step(x_state *s, const double q[X_JOINTS], const double qd[X_JOINTS], const double qdd[X_JOINTS],
    const double measured_q[X_JOINTS], const double measured_qd[X_JOINTS], double current[X_JOINTS]);
#endif
