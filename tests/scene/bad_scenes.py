"""Scene files that must be refused: name, text or bytes, and words that the line must hold."""

from __future__ import annotations

from typing import NamedTuple

RODS = 'rods.kind = "geometrically-exact"'
TRUSS = "structure = { sections = 2, closed = false }"


class Bad(NamedTuple):
    """A refused file: what it is, its content, and what the message names."""

    what: str
    content: str | bytes
    named: tuple[str, ...]


def _scene(what: str, lines: str, *named: str) -> Bad:
    return Bad(what, f'name = "bad"\n{lines}\n', named)


UNKNOWN_KEYS = [
    _scene("top level", "solvr = 1", "solvr", "did you mean solver?"),
    _scene("top level table", "[strucure]\nsections = 6", "strucure", "did you mean structure?"),
    _scene("structure", "structure.section = 6", "structure.section ", "did you mean sections?"),
    _scene("rods", f"{RODS}\nrods.youngs_modulus = 1e11", "rods.youngs_modulus", "young_modulus?"),
    _scene("tube", f"{RODS}\n[rods.bar]\nouter_diameter = 0.01\ninner_diameter = 0.0\nwall = 1.0",
           "rods.bar.wall", "known: outer_diameter, inner_diameter"),
    _scene("joint friction", "joints.pivot.viscos = 0.1", "joints.pivot.viscos", "viscous?"),
    _scene("joint family", "joints.knee.viscous = 0.1", "joints.knee", "pivot, hinge, vjoint"),
    _scene("stop", "stop.stifness = 3.0", "stop.stifness", "did you mean stiffness?"),
    _scene("boom", 'boom = { kind = "rigid", mass = 1.0 }', "boom.mass", "known: ", "length"),
    _scene("other kind's key", 'boom = { kind = "rigid", elements = 4 }', "boom.elements"),
    _scene("net", "net.neutral = 0.7", "net.neutral", "did you mean neutral_length?"),
    _scene("loads", "loads.forces = 0.015", "loads.forces is not", "did you mean force?"),
    _scene("table for another", "load.force = 0.015", "load is not", "did you mean loads?"),
    _scene("key of a campaign", 'fidelity = "frame"', "fidelity", "for a run use --fidelity"),
    _scene("Celsius", "temperature.bar.value = -40.0", "at least 1 K; -40 C are 233.15 K"),
    _scene("millimetres", "structure.half_bar = 1028.7", "at most 1000 m; 1028.7 mm are 1.0287 m"),
    _scene(
        "gigapascal", 'rods = { kind = "geometrically-exact", young_modulus = 120.0 }',
        "at least 100000 Pa; 120 GPa are 1.2e+11 Pa",
    ),
    _scene("capital letters", "loads.force = 1.0\nloads.Force = 1.0", "loads.Force", "mean force?"),
    _scene("solver", "solver.time_step = 0.1", "solver.time_step", "did you mean step?"),
    _scene("record", "record.stresses = true", "record.stresses", "did you mean stress?"),
]  # fmt: skip

WRONG_TYPES = [
    _scene("key of many parts", "a." * 300 + "a = 1", "line 2", "a key of more than 100 parts"),
    _scene("table of many parts", f"[{'a.' * 300}a]", "line 2", "a key of more than 100 parts"),
    _scene("lists in lists", f"loads = {'[' * 200}{']' * 200}", "nested too deeply"),
    _scene("number in quotes", 'structure.half_bar = "0.2889"', "structure.half_bar", "finite", "m"),
    _scene("fraction of a section", "structure.sections = 6.5", "structure.sections = 6.5", "whole"),
    _scene("whole number as float", "structure.sections = 6.0", "structure.sections", "whole"),
    _scene("sections as word", 'structure.sections = "six"', "structure.sections", "whole number"),
    _scene("yes for true", 'structure.closed = "yes"', "structure.closed", "true or false"),
    _scene("1 for true", "record.stress = 1", "record.stress = 1", "true or false"),
    _scene("true for number", "solver.end_time = true", "solver.end_time = true", "finite number"),
    _scene("number for name", "title = 18", "title = 18", "text in quotes"),
    _scene("date for number", "solver.end_time = 2026-11-21", "solver.end_time", "finite number"),
    _scene("list for number", "structure.half_bar = [0.28, 0.29]", "structure.half_bar", "finite"),
    _scene("word within list", f'{TRUSS}\nloads.force = [0.1, "x"]', "loads.force[2]", "finite"),
    _scene("list within list", f"{TRUSS}\nloads.force = [0.1, [0.2]]", "loads.force[2]", "finite"),
    _scene("table for number", "structure.half_bar.value = 0.3", "structure.half_bar", "finite"),
    _scene("number for table", "structure = 18", "structure = 18", "table", "[structure]"),
    _scene("number for union table", "rods = 120e9", "rods", "table", "[rods]"),
    _scene("array of tables", "[[net]]\nstiffness = 0.1", "net", "table", "[net]"),
    _scene("bare load", "loads = 0.015", "loads = 0.015", "table"),
    _scene("part without nothing", 'solver = "none"', "solver", "table"),
]  # fmt: skip

OUT_OF_RANGE = [
    _scene("no section", "structure.sections = 0", "structure.sections = 0", "at least 1"),
    _scene("negative length", "structure.half_bar = -0.3", "half_bar = -0.3 m", "at least 1e-06 m"),
    _scene("too many sections", "structure.sections = 100000", "structure.sections", "at most 360"),
    _scene("angle 0", "structure.opening_angle = 0", "structure.opening_angle = 0 deg", "above 0"),
    _scene("angle 180", "structure.opening_angle = 180", "opening_angle = 180", "179.9"),
    _scene("negative angle", "structure.opening_angle = -44.0", "opening_angle = -44.0 deg", "0 deg"),
    _scene("angle beyond", "structure.opening_angle = 200.0", "opening_angle", "at most 180 deg"),
    _scene("upright ellipse", "structure.aspect_ratio = 1.07", "structure.aspect_ratio", "at most 1"),
    _scene("flat ellipse", "structure.aspect_ratio = 0.001", "structure.aspect_ratio", "least 0.05"),
    _scene("not a number", "loads.force = nan", "loads.force = nan", "finite number in N"),
    _scene("infinite", "solver.end_time = inf", "solver.end_time = inf", "s"),
    _scene("minus infinity in list", f"{TRUSS}\nloads.force = [-inf, 0.1]", "loads.force[1] = -inf"),
    _scene("absurdly small", "structure.half_bar = 1e-300", "structure.half_bar = 1e-300 m", "least"),
    _scene("absurdly large", "net.hub_mass = 1e200", "net.hub_mass = 1e+200 kg", "at most 10000 kg"),
    _scene("absurdly long integer", f"loads.force = 1{'0' * 400}", "loads.force", "finite number"),
    _scene("unreadable integer", f"loads.force = 1{'0' * 5000}", "number cannot be read"),
    _scene("modulus in GPa", f"{RODS}\nrods.young_modulus = 120", "young_modulus = 120 Pa", "100000"),
    _scene("Poisson ratio", f"{RODS}\nrods.poisson_ratio = 0.6", "rods.poisson_ratio", "at most 0.5"),
    _scene("no element", f"{RODS}\nrods.elements = 0", "rods.elements = 0", "at least 1"),
    _scene("negative friction", "joints.hinge.coulomb = -1.0", "joints.hinge.coulomb", "at least 0"),
    _scene("undamped integrator", "solver.spectral_radius = 1.0", "spectral_radius = 1.0", "below 1"),
    _scene("no tolerance", "solver.tolerance = 0.0", "solver.tolerance", "at least 1e-08"),
    _scene("massless hinges", "structure.corner_mass = 0.0", "corner_mass = 0.0 kg", "positive"),
]  # fmt: skip

IMPOSSIBLE = [
    _scene("bars longer than diagonals", "structure.half_bar = 0.5",
           "half_bar = 0.5 m", "below half_diagonal = 0.4275 m"),
    _scene("hinge assembly as long as a bar", "structure.hinge_offset = 0.2889",
           "structure.hinge_offset = 0.2889 m", "below half_bar = 0.2889 m", "shorten it"),
    _scene("closed with two", "structure.sections = 2", "sections = 2", "at least 3", "closed = false"),
    _scene("arc longer than its polygon", "structure = { sections = 18, closed = false }",
           "sections = 18", "below polygon_sections = 18"),
    _scene("boom shorter than the ring", 'boom = { kind = "rigid", length = 0.5 }',
           "boom.length = 0.5 m", "at least 0.855 m"),
    _scene("tube without wall", f"{RODS}\nrods.bar = {{ outer_diameter = 0.01, inner_diameter = 0.01 }}",
           "rods.bar.inner_diameter = 0.01 m", "below outer_diameter"),
    _scene("tube inside out",
           f"{RODS}\nrods.diagonal = {{ outer_diameter = 0.01, inner_diameter = 0.011 }}",
           "rods.diagonal.inner_diameter = 0.011 m", "below outer_diameter = 0.01 m"),
    _scene("rod thicker than long",
           f"{RODS}\nrods.bar = {{ outer_diameter = 0.5, inner_diameter = 0.0 }}",
           "rods.bar.outer_diameter = 0.5 m", "below structure.half_bar"),
    _scene("too few forces", "structure.sections = 6\nloads.force = [0.1, 0.2]",
           "loads.force has 2 values", "needs 6"),
    _scene("no forces", "loads.force = []", "loads.force has 0 values", "needs 18"),
    _scene("arc's net lacks a corner", f"{TRUSS}\nnet.stiffness = [0.1, 0.1]",
           "net.stiffness has 2 values", "needs 3"),
    _scene("friction list", "joints.pivot.viscous = [0.1]", "joints.pivot.viscous has 1", "needs 18"),
    _scene("starts beyond its stop", "stop.stowed_angle = 50.0",
           "stop.stowed_angle = 50.0 deg", "below structure.opening_angle"),
    _scene("hinge pulleys that coincide",
           f"{RODS}\nstructure.hinge_offset = 0.0\n[cables.upper]\n"
           'winch.winding = { kind = "constant", speed = 0.01 }',
           "structure.hinge_offset = 0.0 m", "at least 1e-06 m", "leave the cables out"),
    _scene("motor without torque at its speed",
           "[cables.upper.winch.winding]\nkind = 'motor'\nno_load_speed = 500.0\n"
           "stall_torque = 0.01\ndrum_radius = 0.01\nspeed = 700.0",
           "cables.upper.winch.winding", "speed = 700.0 rad/s must be below", "no torque at its"),
    _scene("gear that gains", "[cables.upper.winch.winding]\nkind = 'motor'\n"
           "no_load_speed = 500.0\nstall_torque = 0.01\ndrum_radius = 0.01\nefficiency = 1.5",
           "cables.upper.winch.winding.efficiency = 1.5", "at most 1"),
    _scene("step longer than the run", "solver = { step = 2.0, end_time = 1.0 }",
           "solver.step = 2.0 s", "end_time = 1.0 s"),
    _scene("spacecraft without boom", "spacecraft = { mass = 9.0, inertia = [1.0, 1.0, 1.0] }",
           "spacecraft needs a boom", "add [boom]"),
    _scene("spacecraft on a fixed boom",
           'boom = { kind = "rigid", base = "fixed" }\n'
           "spacecraft = { mass = 9.0, inertia = [1.0, 1.0, 1.0] }",
           'boom.base = "fixed"', 'must be "free"'),
    _scene("moments of no body", "spacecraft = { mass = 9.0, inertia = [1.0, 1.0, 2.1] }",
           "spacecraft.inertia[3] = 2.1 kg m^2", "at most the sum of the others, 2"),
    _scene("gravity on a free base", "gravity.vector = [0.0, 0.0, -9.81]",
           "gravity.vector = [0.0, 0.0, -9.81] m/s^2", "would fall", 'boom.base = "fixed"'),
    _scene("gravity beside a spacecraft",
           "gravity.vector = [0.0, 0.0, -9.81]\n"
           "[spacecraft]\nmass = 9.0\ninertia = [1.0, 1.0, 1.0]\n[boom]\nkind = 'rigid'",
           "gravity.vector", "with a spacecraft: the structure would fall",
           "leave [spacecraft] out and fix the structure"),
    _scene("spacecraft on lines",
           "gravity.vector = [0.0, 0.0, -9.81]\n[offload]\n"
           "[spacecraft]\nmass = 9.0\ninertia = [1.0, 1.0, 1.0]\n[boom]\nkind = 'rigid'",
           "gravity.vector", "spacecraft of 9 kg", "would carry it", "leave [spacecraft] out"),
    _scene("a corner that no residual has",
           "gravity.vector = [0.0, 0.0, -9.81]\n[offload]\ncorners = [1, 19]\nresidual = ["
           + "0.0, " * 17 + "0.1]", "offload.corners[2] = 19", "at most 18"),
    _scene("lines that leave some weight",
           "gravity.vector = [0.0, 0.0, -9.81]\n[offload]\ncorners = [1, 2]\nresidual = 0.01",
           "offload.residual = 0.01", "would fall", "offload.stiffness"),
    _scene("lines that lift too much",
           "gravity.vector = [0.0, 0.0, -9.81]\n[offload]\nresidual = -0.01",
           "offload.residual = -0.01", "would rise", "a mean residual of 0"),
    _scene("offload without weight", "[offload]", "offload", "add [gravity]"),
    _scene("offload at no corner",
           "gravity.vector = [0.0, 0.0, -9.81]\noffload.corners = [3, 19]",
           "offload.corners[2] = 19", "at most 18", "no such corner"),
    _scene("no gravity", "gravity.vector = [0.0, 0.0, 0.0]", "gravity.vector", "leave gravity out"),
    _scene("result beyond memory", "record.interval = 1e-8", "record.interval = 1e-08 s", "at least"),
]  # fmt: skip

KINDS = [
    _scene("unknown structure", 'structure.kind = "hexapod"', "structure.kind", "pantograph-ring"),
    _scene("unknown rods", 'rods.kind = "rigd"', 'rods.kind = "rigd"', "geometrically-exact"),
    _scene("misspelt rods", 'rods.kind = "acnf"', "rods.kind", "did you mean ancf?"),
    _scene("no kind of boom", "boom.length = 0.9", "boom.kind is missing", '"flexible" or "rigid"'),
    _scene("kind as number", "rods.kind = 3", "rods.kind = 3", "ancf"),
    _scene("kind as list", 'rods.kind = ["ancf"]', "rods.kind", "did you mean ancf?"),
    _scene("unknown base", 'boom = { kind = "rigid", base = "loose" }', "boom.base", "free", "fixed"),
    _scene("unknown step control", 'solver.step_control = "auto"', "step_control", "motion"),
]  # fmt: skip

NAMES = [
    Bad("nameless", "title = 'x'\n", ("name is missing",)),
    Bad("empty file", "", ("name is missing",)),
    Bad("empty name", 'name = ""\n', ('name = ""', "letters")),
    Bad("name with blanks", 'name = "my ring"\n', ('name = "my ring"', "letters")),
    Bad("name with line break", 'name = "a\\nb"\n', ("name", "letters")),
    Bad("name as folder", 'name = "../ring"\n', ('name = "../ring"', "letters")),
    Bad("endless name", f'name = "{"a" * 500}"\n', ("name", "at most 80 characters")),
    Bad("endless title", f'name = "a"\ntitle = "{"a" * 500}"\n', ("title", "at most 300")),
]

BROKEN = [
    _scene("no value", "solver.step =", "not valid TOML", "line 2"),
    _scene("open string", 'title = "ring', "not valid TOML", "line 2"),
    _scene("open list", "loads.force = [1, 2", "not valid TOML"),
    _scene("open header", "[structure", "not valid TOML", "line 2"),
    _scene("key twice", "solver.step = 0.1\nsolver.step = 0.2", "not valid TOML", "line 3"),
    _scene("table twice", "[net]\ndamping = 0.1\n[net]\ndamping = 0.2", "not valid TOML"),
    _scene("value then table", "net = 3\n[net]\ndamping = 0.2", "not valid TOML"),
    _scene("colon", "solver: 3", "not valid TOML", "line 2"),
    _scene("number with comma", "structure.half_bar = 0,3", "not valid TOML", "line 2"),
    _scene("nested beyond reason", f"loads.force = {'[' * 3000}", "nested too deeply"),
    Bad("JSON", '{"name": "bad"}\n', ("not valid TOML", "line 1")),
    Bad("invalid UTF-8", b'name = "b\xe4d"\n', ("byte 10", "UTF-8")),
    Bad("UTF-16", 'name = "bad"\n'.encode("utf-16"), ("byte 1", "UTF-8")),
    Bad("binary", bytes(range(256)), ("UTF-8",)),
    Bad("null bytes", b'name = "bad"\x00\n', ("not valid TOML",)),
]

BAD_SCENES = {
    f"{group}-{bad.what}": bad
    for group, bads in {
        "unknown-key": UNKNOWN_KEYS, "type": WRONG_TYPES, "range": OUT_OF_RANGE,
        "impossible": IMPOSSIBLE, "kind": KINDS, "name": NAMES, "broken": BROKEN,
    }.items()
    for bad in bads
}  # fmt: skip
