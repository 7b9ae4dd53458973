"""What scenes and campaigns may hold: every key with its unit, default, range and meaning.

All of it is read from the records themselves, so that no description can disagree with them.  The
words that tables, verdicts and figures use stand here.
"""

import difflib
import re

WORDS = {
    "by chance up to": "see chance",
    "both error bars": "root sum of squares of those of the two engines, in the sample with the "
    "largest difference",
    "beyond all samples": "readings beyond those of all samples of a campaign, and their errors",
    "chance": "what the largest of all inputs reaches in one output of 20 if none has any "
    "influence; the short tables list what is beyond it",
    "attempts": "how often a sample was run, as one that failed is with --retry-failed",
    "better by": "by how much the objective of the first design is better than that of another "
    "one, an interval of 95 %",
    "change": "by how much a probability would change, as a share of it",
    "check": "a run of a sample by the other engine, too, beside which it is laid",
    "cut off": "outcome of a run: still moving, or driven, at solver.end_time",
    "clock": "offset and drift of a test's time against the run's, found with the unknowns",
    "counted drive": "what drives at an angle, as the standard of the margin counts it",
    "confidence": "how sure a verdict must be: in such a share of studies its bound holds",
    "correlation": "see rank correlation and partial rank correlation",
    "deployed": "outcome of a run: every V-joint has come to 180 deg, and all latches hold",
    "difference": "the second less the first, of means or of shares",
    "differs in": "values of the scene that two campaigns do not have alike",
    "dominates": "which error of a mean is the largest: of the draw, of steps and elements, or "
    "between the engines",
    "drive margin": "what drives over all that resists, with its standard's factors, less 1; where "
    "it is least it is the variable least_drive_margin",
    "effect": "mu*, the mean absolute change of an output by a move of a group (Morris), in the "
    "output's unit",
    "empty cells": "cells of a measured table without a reading",
    "engines": "part of the error of a mean: root mean square of the differences between the two "
    "engines, over the samples that were checked",
    "effective samples": "how many plain samples of the other distribution the weighted ones are "
    "worth",
    "error bar": "how far the steps and elements of a run may put a number off, by a second run "
    "with steps half as long and twice the elements",
    "error of the mean": "how far a mean may be off by the draw (sampling), by steps and elements "
    "(numerical) and by the engine (engines); the last two do not average out",
    "error of the solution": "what a run's own balances leave: of energy, and of gaps in joints",
    "estimate": "the value by all samples, which its interval is of",
    "failed runs": "samples whose run failed, so that nothing is known of the antenna; lower "
    "bounds count them as violating",
    "event": "what a rare-event study asks the probability of",
    "fan": "figure of how far each section is ahead of the mean opening angle or behind it, over "
    "time and samples",
    "first-order index": "share of an output's variance that an input, or a group, explains by "
    "itself",
    "given-data index": "first-order index from bins of plain samples, corrected for chance",
    "held": "a reading that does not fit and is kept, because it and the others like it are too "
    "many, or too much together, for chance",
    "index": "see first-order index and total index",
    "interval": "where a statistic of all antennas lies with 95 % confidence, by the samples that "
    "were drawn; it says nothing of numerical errors",
    "its error bar": "error bar of the value beside it, see error bar",
    "lag": "how far the opening angle of a joint is from the mean of all at that time; of a motor "
    "how long it is slower than commanded",
    "kind": "which of several forms a table has, such as a law of an input; explain of the table's "
    "key lists them",
    "largest bar": "the largest error bar of a sample, and which sample has it",
    "largest difference": "the largest difference between the engines, and in which sample; of a "
    "test between measured and computed",
    "largest difference of a pair": "the largest, by its size, of the differences of the second "
    "less the first in the same sample",
    "least": "the smallest value of all samples used",
    "learnt": "what is left of an unknown's scatter, see remaining scatter",
    "left out": "samples, readings or parts of a scene that are not used",
    "limit": "a bound on an output, from requirements or from limits of the scene",
    "law": "the distribution of an input; explain inputs lists all kinds",
    "mean": "sum over the samples used by their number",
    "median": "see quantile",
    "most": "the largest value of all samples used",
    "median sample": "the sample in the middle by asynchrony_max, or deployment_time where there "
    "is none: of all, or of those that ended alike",
    "met": "the samples show, at the confidence asked for, that the probability is as required",
    "not met": "the samples show, at the confidence asked for, that it is not",
    "log": "what the solver printed in a run that failed",
    "lock order": "figure of which V-joint locks first, second, ... and last, in how many samples",
    "may be off": "samples in which the number is uncertain: steps at a lock were too long or "
    "pulley friction was smoothed away (?), or the limit is closer than the numerical error",
    "mean difference": "mean of measured less computed over the readings of a sensor",
    "mechanism": "how many modes move a structure of rigid rods: nothing but inertia holds them",
    "modal mass": "the mass that a natural mode moves, its shape 1 where it is largest",
    "no population": "the samples were chosen, not drawn: there are no probabilities of antennas",
    "no value": "samples whose run holds and that have nothing to measure the output by, such as "
    "a deployment time where the ring did not open",
    "not latched": "outcome of a run: all V-joints came to 180 deg, and latches did not catch",
    "not explained": "the unknowns do not fit the data within their errors: the model, or an error "
    "that was given, is wrong",
    "numerical": "part of the error of a mean: root mean square of the error bars over the samples "
    "that have them",
    "not yet shown": "neither met nor broken by the samples so far: more of them are needed",
    "of the first": "the same from so many of the samples, in their order: where it still moves, "
    "more samples are needed",
    "one-sided bound": "the bound of the probability that decides a verdict: the least of it for "
    "met, the most for not met, at the confidence asked for (Clopper and Pearson)",
    "overrides": "settings with which --retry-failed --set ran a sample again",
    "overloaded": "outcome of a run in which a limit of the scene was passed: a V-joint past its "
    "stop, a rope's strain or tension, a rod's stress",
    "partial": "see partial rank correlation",
    "pairs": "samples of two campaigns with the same number and seed, in which shared inputs are "
    "alike; in what separates: a sample of the group and one outside",
    "partial rank correlation": "rank correlation of an input and an output with what all other "
    "inputs tell of either taken off; -1 to 1",
    "partly deployed": "outcome of a run: at rest with some V-joints locked, and nothing drives "
    "the others",
    "posterior": "what is known of an unknown after the test: a distribution",
    "prior": "what is known of an unknown before the test: its distribution in the file",
    "probability": "share of all antennas, of which the samples show an interval",
    "quantile": "the value below which such a share of the samples lies, between two ranked "
    "samples along a straight line; the median is that of 50 %",
    "rank correlation": "correlation of the ranks of an input and an output (Spearman): 1 or -1 if "
    "one grows or falls with the other, however bent",
    "rank correlation of pairs": "correlation of the ranks of an output in both samples of each "
    "pair: near 1 samples that are bad on one side are so on the other",
    "reason": "why a run ended, in words, and what it says of its numbers",
    "remaining scatter": "the posterior's standard deviation over the prior's, of the normal "
    "variable behind the law: 1 where the data tell nothing",
    "requirement": "a bound on an output, with the probability and the confidence that it asks for",
    "rms difference": "root mean square of measured less computed over the readings of a sensor",
    "rms / sigma": "root mean square of measured less computed over the standard deviation of a "
    "reading: about 1 where the run explains the data",
    "samples beyond": "samples whose value is beyond the limit of the scene, each beyond its own "
    "where it is drawn",
    "samples checked": "samples that both engines have run",
    "samples that meet": "see share that meets it",
    "samples to go": "how many more samples, none of them violating, would show the requirement",
    "samples used": "samples whose run holds; in statistics of an output those that have a value "
    "of it, in verdicts also those without, which violate",
    "samples with bars": "samples that have an error bar of the output",
    "sample": "one set of drawn values, and the run with them",
    "sample_seed": "seed of a sample, by which samples of two campaigns are paired",
    "sampling": "part of the error of a mean: by the draw of the samples, as a standard error",
    "second-order index": "share of an output's variance that two inputs explain together, beyond "
    "what each does by itself",
    "separation": "of all pairs of a sample in the group and one outside, the share in which the "
    "one in the group has the larger (or smaller) input; 50 % tells nothing",
    "set aside": "readings that do not fit, few enough to be left out: strays",
    "share that meets it": "samples that keep to the requirement over all that ran",
    "slack": "a rope that is longer than its way and carries nothing but the little tension of "
    "slack_width",
    "slackened": "outcome of a run: a rope was slack for longer than the scene's limits allow",
    "smoothed": "pulley friction that acts only in part, because the rope is slower than the slip "
    "speed asks for",
    "stalled": "outcome of a run: at rest with no V-joint locked, and nothing drives it",
    "standard error": "how far a mean is off by the draw of the samples, as a standard deviation",
    "statistic": "a number of all samples: their mean, standard deviation, a quantile, or an end",
    "std. dev.": "standard deviation over the samples used (their number less 1)",
    "stray": "one of few readings that do not fit: it is set aside, and named",
    "tornado": "figure of what matters: the inputs of each output, the strongest on top",
    "total index": "share of an output's variance that goes with a group, by itself or together "
    "with others; what is near 0 may be left out",
    "violating": "samples that break the requirement, or have no value of its output",
    "unit": "that of the output, after the SI prefix that suits its values",
    "verdict without failed runs": "the verdict if failed runs did not count as violations",
    "unusual inputs": "inputs of a sample that few others have so large or so small, of those that "
    "go with what it is worst in",
    "verdict": "met, not met or not yet shown: what the samples say of a requirement",
    "what changes a probability": "how much rarer violations would be if an input scattered less, "
    "or its mean moved",
    "what matters": "the inputs that an output goes with beyond chance, the strongest first",
    "what separates": "inputs by which the samples of a group differ from the others, see "
    "separation",
    "worst": "see worst sample",
    "worst sample": "the one whose output is farthest to the side that is bad for an antenna",
    "worst value": "see worst sample",
    "worst of": "the samples in which a requirement or an outcome is missed by most, the worst "
    "first",
    "within 90 %": "share of the readings in the band that holds 90 % of the samples",
    "worse in": "the side of a comparison that is worse in the output: where the 95 % interval of "
    "the difference leaves out zero; - where it does not, where less than 0.1 % or the numerical "
    "error is between the two, or where an output has no bad side",
    "+-": "numerical error bar, from a second run with half the steps and twice the elements",
    "?": "runs call the number uncertain themselves, because their steps at locks were too long, "
    "or their pulley friction was smoothed away; a line tells what cures it",
    "*": "runs that failed depend on inputs: the others, of which the number is, are another "
    "population",
}
"""Words of tables, verdicts and figures that are no variable and no key, with what they mean."""


def word(name: str) -> str:
    """What a word, or one nearly like it, means, as "stray: ..."; empty if it is none of these.

    A head of a table is told without what it is of: "mean of", "95 % interval of it",
    "verdict in flight", "sampling (standard error)".

    >>> word("largest bar") == word("Largest bars")
    True
    >>> word("95 %") == word("quantile")
    True
    """
    if re.fullmatch(r"[\d.]+ %", name):
        name = "quantile"
    bare = re.sub(r" ?[\d.]+ % ?", "", name.lower())
    for each in (bare, *(bare.partition(part)[0] for part in (" (", " of ", " in ", " for "))):
        own = each.removesuffix(" of").removesuffix(" there")
        near = difflib.get_close_matches(own, WORDS, n=1, cutoff=0.85)
        # Of short words others are near that mean something else: lock, clock.
        if near and near[0][0] == own[0] and (len(own) > 6 or own in (near[0], f"{near[0]}s")):
            return f"{near[0]}: {WORDS[near[0]]}"
    return ""
