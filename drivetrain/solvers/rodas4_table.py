"""The numbers of RODAS: a Rosenbrock method of order 4 with a check of order 3, six stages, stiffly accurate, L-stable.

In the form that multiplies by no matrix, with W = 1/(h GAMMA) - J,

    W u_i = f(t + ALPHA_i h, y + sum_j A_ij u_j) + sum_j C_ij u_j / h + GAMMAS_i h df/dt,

stages 5 and 6 start from the result of the one before plus u_5 and so on, the result is y_6 + u_6, and u_6 is the
error. Between the ends of a step y(s) = (1-s) y_0 + s (y_1 + (1-s) (B_1 + s B_2)), where B_k = sum_j D_kj u_j.
A test holds the tables against the conditions of order.

Reference: Hairer, Wanner, Solving Ordinary Differential Equations II (1996), section IV.7 and the program RODAS.
"""

from __future__ import annotations

GAMMA = 0.25
ALPHA2, ALPHA3, ALPHA4 = 0.386, 0.21, 0.63  # of stages 5 and 6: 1
GAMMA1, GAMMA2, GAMMA3, GAMMA4 = 0.25, -0.1043, 0.1035, -0.03620000000000023  # of stages 5 and 6: 0
A21 = 1.544
A31, A32 = 0.9466785280815826, 0.2557011698983284
A41, A42, A43 = 3.314825187068521, 2.896124015972201, 0.9986419139977817
A51, A52, A53, A54 = 1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950
C21 = -5.6688
C31, C32 = -2.430093356833875, -0.2063599157091915
C41, C42, C43 = -0.1073529058151375, -9.594562251023355, -20.47028614809616
C51, C52, C53, C54 = 7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160
C61, C62, C63, C64, C65 = (
    8.083246795921522,
    -7.981132988064893,
    -31.52159432874371,
    16.31930543123136,
    -6.058818238834054,
)
D11, D12, D13, D14, D15 = (
    10.12623508344586,
    -7.487995877610167,
    -34.80091861555747,
    -7.992771707568823,
    1.025137723295662,
)
D21, D22, D23, D24, D25 = (
    -0.6762803392801253,
    6.087714651680015,
    16.43084320892478,
    24.76722511418386,
    -6.594389125716872,
)
