/* Slopes of dry friction for Newton, where ropes or joints turn round within a step; see
   ringsim/core/chain.py. */

#include "core.h"

/* Remember an iterate: rates of all pulleys or joints. */
void note_rates(const Seen *seen, const D *rates, I n) {
    D *ahead = seen->last.at, *behind = ahead + n;
    for (I k = 0; k < n; k++) {
        bool back = rates[k] < 0.0, first = seen->begun.at[0] == 0;
        if (first) ahead[k] = behind[k] = NAN;
        bool stays = first || back == (seen->back.at[k] != 0);
        seen->stayed.at[k] = first ? 0 : stays ? seen->stayed.at[k] + 1 : 0;
        seen->back.at[k] = back;
        (back ? behind : ahead)[k] = rates[k];
    }
    seen->begun.at[0] = 1;
}

/* The rate noted last on the other side; none where it was never seen. */
D rate_across(const Seen *seen, I k) {
    return seen->last.at[seen->back.at[k] ? k : seen->last.each + k];
}

/* Slope of a law at the iterate noted last: its own, or what the other side asks for, where the law
   is `there`. */
D slope_between(const Seen *seen, I k, D rate, D own, D here, D there) {
    D secant = (here - there) / (rate - rate_across(seen, k));
    /* fmax: the own one where the other side was never seen. */
    return fmax(own, ldexp(secant, -(int)seen->stayed.at[k]));
}

/* The same of all, for laws that Python evaluates. */
void rates_across(const Seen *seen, D *out, I n) {
    for (I k = 0; k < n; k++) out[k] = rate_across(seen, k);
}

void slopes_between(const Seen *seen, const D *rates, I n, const D *own, I n_own, const D *here,
                    I n_here, const D *there, I n_there, D *out, I n_out) {
    (void)n_own, (void)n_here, (void)n_there, (void)n_out;
    for (I k = 0; k < n; k++) out[k] = slope_between(seen, k, rates[k], own[k], here[k], there[k]);
}
