"""The columns of a system, named once: a cable, its fish and the medium as a row of numbers.

Dimensionless as in NRL Report 7048, Table 1: length of the cable, weight and mass of the fish, drag constants of the
cable and of the fish, weight of the cable, tangential drag constant of the cable; its side force constant and the sine
at which that force is at its largest.
"""

COLUMNS = ("lam", "w_f", "m_f", "C", "C_f", "w", "C_t", "C_s", "b_s")
LAM, W_F, M_F, C, C_F, W, C_T, C_S, B_S = range(len(COLUMNS))
