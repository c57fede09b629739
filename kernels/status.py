"""Outcome codes of a computation, with the sentence a user reads for each.

Codes are stored in files as int8: never renumber, only append.
"""

OK = 0
NO_TRANSITION = 1
STEP_LIMIT = 2
NOT_CONVERGED = 3
OUTSIDE = 4
NOT_FOUND = 5
BAD_INPUT = 6
LOST_IN_ROUNDING = 7
NEAR_FOLD = 8
NO_PAIR = 9
NEVER_ENDS = 10
NO_CUSP = 11
NOT_AGAIN = 12
FLOW_OUTRUNS_WAVES = 13
NOT_COUNTED = 14
BEYOND = 15
UNFINISHED = 16

SENTENCES = {
    OK: "computed",
    NO_TRANSITION: "no such transition: the cable is not longer than lambda_cn",
    STEP_LIMIT: "the shots are too long: too many nodes at this speed, or too much drag where the cable is slack; with "
    "more patience longer ones are made",
    NOT_CONVERGED: "the direct solver did not converge; please report the inputs",
    OUTSIDE: "outside the range of the atlas; ask for the direct solver",
    NOT_FOUND: "the scan found no such transition up to its highest speed",
    BAD_INPUT: "an input is not finite, not positive (lambda), negative (w_f), or so large or small that it overflows",
    LOST_IN_ROUNDING: "lambda is so close to lambda_cn that rounding leaves fewer than four digits of the answer",
    NEAR_FOLD: "too close to a fold to interpolate; ask for the direct solver",
    NO_PAIR: "too much drag: the n-th pair of the vacuum never appears; drag may make others, see towatlas folds",
    NEVER_ENDS: "the pair does not end up to the highest speed looked at",
    NO_CUSP: "no cusp: as the drag rises, the pair appears at ever higher speed, up to the highest looked at",
    NOT_AGAIN: "the pair does not come again up to the highest speed looked at",
    FLOW_OUTRUNS_WAVES: "the flow along the cable is faster than its waves, as next to a bare end: motions of any "
    "frequency may grow there, so that a count of those that do means nothing",
    NOT_COUNTED: "growth rates were found, but not that there are no others",
    BEYOND: "even without drag the pair appears beyond the highest speed looked at",
    UNFINISHED: "not finished within the patience; go on with --patience SECONDS (in Python: with "
    "towatlas.patience(SECONDS))",
}

# Names for CF flag_meanings: one word each, in the order of the codes.
FLAG_MEANINGS = (
    "computed no_transition step_limit not_converged outside_atlas not_found_by_scan bad_input lost_in_rounding "
    "near_fold no_pair never_ends no_cusp not_again flow_outruns_waves not_counted beyond unfinished"
)
