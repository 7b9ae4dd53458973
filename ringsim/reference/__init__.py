"""What scenes and campaigns may hold: every key with its unit, default, range and meaning.

All of it is read from the records themselves, so that no description can disagree with them.  The
words that tables, verdicts and figures use stand here.
"""

import difflib

WORDS = {
    "bound of the probability": "the least probability that the samples show at the confidence "
    "asked for, by the exact one-sided bound of Clopper and Pearson",
    "chance": "what the largest of all inputs reaches in one output of 20 if none has any "
    "influence; the short tables list what is beyond it",
    "check": "a run of a sample by the other engine, too, beside which it is laid",
    "clock": "offset and drift of a sensor's time against the run's, found with the unknowns",
    "drive margin": "what drives over all that resists, each with its standard's factor, less 1, "
    "at the angle where it is least; the variable is least_drive_margin",
    "effect": "mu*, the mean absolute change of an output by a move of a group (Morris), in the "
    "output's unit",
    "effective samples": "how many plain samples of the other distribution the weighted ones are "
    "worth",
    "error bar": "how far the steps and elements of a run may put a number off, by a second run "
    "with half the steps and twice the elements",
    "first-order index": "share of an output's variance that an input, or a group, explains by "
    "itself",
    "given-data index": "first-order index from bins of plain samples, corrected for chance",
    "held": "a reading that does not fit and is kept, because it and the others like it are too "
    "many, or too much together, for chance",
    "interval": "where a statistic of all antennas lies with 95 % confidence, by the samples that "
    "were drawn; it says nothing of numerical errors",
    "lag": "how far the opening angle of a joint is from the mean of all at that time; of a motor "
    "how long it is slower than commanded",
    "learnt": "the posterior's standard deviation over the prior's: 1 where the data tell nothing",
    "may be off": "samples in which the number is uncertain: steps at a lock were too long (?), or "
    "the limit is closer than the numerical error",
    "not explained": "the unknowns do not fit the data within their errors: the model, or an error "
    "that was given, is wrong",
    "not yet shown": "neither met nor broken by the samples so far: more of them are needed",
    "overloaded": "outcome of a run in which a limit of the scene was passed: a V-joint past its "
    "stop, a rope's strain or tension, a rod's stress",
    "partial rank correlation": "rank correlation of an input and an output with what all other "
    "inputs tell of either taken off; -1 to 1",
    "posterior": "what is known of an unknown after the test: a distribution",
    "prior": "what is known of an unknown before the test: its distribution in the file",
    "rank correlation": "correlation of the ranks of an input and an output (Spearman): 1 or -1 if "
    "one grows or falls with the other, however bent",
    "samples to go": "how many more samples, none of them violating, would show the requirement",
    "separation": "of all pairs of a sample in the group and one outside, the share in which the "
    "one in the group has the larger (or smaller) input; 50 % tells nothing",
    "share that meets it": "samples that keep to the requirement over all that ran",
    "slack": "a rope that is longer than its way and carries nothing but the little tension of "
    "slack_width",
    "standard error": "how far a mean is off by the draw of the samples, as a standard deviation",
    "stray": "one of few readings that do not fit: it is set aside, and named",
    "tornado": "figure of what matters: the inputs of each output, the strongest on top",
    "total index": "share of an output's variance that goes with a group, by itself or together "
    "with others; what is near 0 may be left out",
    "worst sample": "the one whose output is farthest to the side that is bad for an antenna",
    "?": "runs call the number uncertain themselves, because their steps at locks were too long; "
    "a line tells the tolerance that cures it",
    "*": "runs that failed depend on inputs: the others, of which the number is, are another "
    "population",
}
"""Words of tables, verdicts and figures that are no variable and no key, with what they mean."""


def word(name: str) -> str:
    """What a word, or one nearly like it, means, as "stray: ..."; empty if it is none of these."""
    near = difflib.get_close_matches(name.lower(), WORDS, n=1, cutoff=0.85)
    return f"{near[0]}: {WORDS[near[0]]}" if near else ""
