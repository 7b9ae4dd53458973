"""Mistakes that a new user makes: one line that names field, value, bound and cure."""

import os
import pty
import re
import subprocess
import sys
import termios
from pathlib import Path

import numpy as np
import preloaded
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

from ringsim import load_scene, simulate
from ringsim.cli import VERBS, cli, main
from ringsim.dataset import save
from ringsim.refusal import EXIT_BAD_INPUT, InputError

CAMPAIGN = """name = "mine"
scene = "truss2"
fidelity = "frame"
set = { solver.end_time = 0.5 }
design = { kind = "random", samples = 4 }
[inputs]
"structure.corner_mass" = { kind = "normal", mean = 0.02, standard_deviation = 0.001 }
"""


def refused(*arguments: object) -> str:
    """The one line with which a command is refused."""
    words = [str(each) for each in arguments]
    result = CliRunner().invoke(cli, words, standalone_mode=False)  # as the command does
    assert result.return_value == EXIT_BAD_INPUT, result.output
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    return result.stderr.strip()


def ringsim(*arguments: object) -> str:
    result = CliRunner().invoke(cli, [str(each) for each in arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_unknown_verb_is_told_the_nearest() -> None:
    assert refused("chek", "ring18") == "ringsim chek: there is no such verb (did you mean check?)"
    assert "known: scenes, check, run" in refused("xyzzy")


@for_each("verb", ["run", "check", "stability", "accuracy"])
def test_campaign_file_is_no_scene(verb: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(CAMPAIGN)
    line = refused(verb, path)
    assert line.startswith("mine.toml: design: this is a campaign file, not a scene")
    assert "run it with ringsim campaign" in line


def test_scene_file_is_no_campaign(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(load_scene("truss2").to_toml())
    line = refused("campaign", path)
    assert line.startswith("mine.toml: structure: this is a scene, not a campaign file")
    assert 'ringsim run, or name it in a campaign file, as scene = "mine.toml"' in line


def test_simulate_takes_a_name_or_a_file(tmp_path: Path) -> None:
    short = load_scene("truss2").with_values({"solver.end_time": 0.2})
    path = tmp_path / "short.toml"
    path.write_text(short.to_toml())
    expected = simulate(short, "frame")
    for given in (path, str(path)):
        found = simulate(given, "frame")
        np.testing.assert_array_equal(found["opening_angle"], expected["opening_angle"])


def test_simulate_refuses_what_it_does_not_know() -> None:
    with pytest.raises(InputError, match="did you mean ring18"):
        simulate("ring81")
    with pytest.raises(InputError, match=r'fidelity = "frmae": .*did you mean frame\?'):
        simulate("truss2", fidelity="frmae")


def test_rigid_rods_are_no_fidelity_any_more(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(CAMPAIGN.replace('"frame"', '"ideal"'))
    for line in (refused("run", "truss2", "--fidelity", "ideal"), refused("campaign", path)):
        assert line.endswith('no longer available: choose fidelity = "frame"')
    with pytest.raises(InputError, match=r'fidelity = "ideal": .* choose fidelity = "frame"'):
        simulate("truss2", fidelity="ideal")


def test_angle_in_radians_is_refused_with_the_degrees_it_means() -> None:
    line = refused("check", "ring18", "--set", "structure.opening_angle=0.35")
    assert "structure.opening_angle = 0.35 deg must be at least 1 deg" in line
    assert "write 20.05 if 0.35 rad is meant" in line
    assert "20.05" in refused("run", "truss2", "--set", "structure.opening_angle=0.35")


def test_angle_that_may_be_in_radians_is_remarked() -> None:
    shown = ringsim("check", "ring18", "--set", "structure.opening_angle=1.5")
    assert "at 1.5 deg (1.5 rad would be 85.94 deg)" in shown
    assert "rad" not in ringsim("check", "ring18").partition("initial")[2].splitlines()[0]


def test_other_suffix_than_nc_is_refused_before_the_run(tmp_path: Path) -> None:
    line = refused("run", "truss2", "--out", tmp_path / "t.csv")
    assert f"{tmp_path / 't.csv'}: " in line
    assert "must end with .nc: write t.nc" in line
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match=r"must end with \.nc"):
        save(xr.Dataset(), tmp_path / "t.h5")


def test_files_of_a_campaign_are_not_replaced(tmp_path: Path) -> None:
    """The scenes of a campaign lie beside its results, and so may those of a run."""
    run = "run", "truss2", "--fidelity", "frame", "--set", "solver.end_time=0.2", "--out"
    (tmp_path / "campaign.nc").write_text("any")
    assert "replaced" in ringsim(*run, tmp_path / "campaign.nc")
    for name in ("design.nc", "campaign.nc"):
        (tmp_path / name).write_text("kept")
    for name in ("design.nc", "campaign.nc"):
        assert "belongs to the campaign in its folder" in refused(*run, tmp_path / name)
        assert (tmp_path / name).read_text() == "kept"


def test_limits_of_the_scene_are_told_where_they_belong(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(CAMPAIGN + "[limits]\ntension = 60.0\n")
    assert '(that is a limit of the scene: [set] "limits.tension" = VALUE)' in refused(
        "campaign", path
    )


def test_a_file_without_end_is_refused() -> None:
    assert refused("check", "/dev/zero").startswith("/dev/zero: longer than 50,000,000 letters")


def test_a_run_says_that_it_replaces_a_file(tmp_path: Path) -> None:
    words = "run", "truss2", "--fidelity", "frame", "--set", "solver.end_time=0.2", "--out"
    path = tmp_path / "t.nc"
    assert f"wrote {path}" in ringsim(*words, path)
    assert f"replaced {path}" in ringsim(*words, path)


def test_stress_of_a_planar_truss_is_that_of_its_bending_strain() -> None:
    """Where the strut pushes, both halves of the beam end: the larger of their stresses is at
    least E times the mean bending strain there, which is recorded by itself."""
    scene = load_scene("planar-truss").with_values(
        {
            "record.stress": True, "rods.damping": 0.0,
            "solver.end_time": 0.3, "solver.energy_tolerance": 1e3,
        }
    )  # fmt: skip
    run = simulate(scene)
    assert run["rod_stress"].sizes["rod"] == 3
    both = run["rod_stress"].sel(rod=["upper_beam_left", "upper_beam_right"])
    largest = both.max(("rod", "section"))
    at_strut = run["bending_strain"].sel(station=scene.structure.strut_head, method="nearest")
    bending = np.abs(at_strut) * scene.rods.young_modulus
    assert (bending > 0.0).any()
    assert (largest >= bending * (1.0 - 1e-9)).all()


def test_hinge_pulleys_that_coincide_are_refused_before_the_run() -> None:
    line = refused("run", "truss2", "--set", "structure.hinge_offset=0")
    assert "structure.hinge_offset = 0.0 m must be at least 1e-06 m with cables" in line


def test_key_of_another_kind_is_told_from_a_misspelt_one() -> None:
    ring = "structure.kind=pantograph-ring"
    line = refused("check", "planar-truss", "--set", ring, "--set", "structure.beam_length=0.5")
    assert 'structure.beam_length is not a known key (kind = "planar-truss" has it' in line
    assert 'structure = { kind = "pantograph-ring" }' in line
    truss = "structure.kind=planar-truss"
    line = refused("check", "ring18", "--set", truss, "--set", "structure.sections=4")
    assert 'has it, "planar-truss" has not' in line


def test_changed_distribution_is_told_with_its_input(tmp_path: Path) -> None:
    path, out = tmp_path / "mine.toml", tmp_path / "out"
    one = CAMPAIGN.replace("samples = 4", "samples = 1")
    path.write_text(one)
    ringsim("campaign", path, "--workers", 0, "--out", out)
    path.write_text(one.replace("mean = 0.02", "mean = 0.021"))
    line = refused("campaign", path, "--workers", 0, "--out", out)
    assert "inputs.structure.corner_mass: mean = 0.021 instead of 0.02" in line
    assert "--out" in line
    path.write_text(one.replace("end_time = 0.5", "end_time = 0.6"))
    line = refused("campaign", path, "--workers", 0, "--out", out)
    assert "its scene differs: solver.end_time = 0.6 instead of 0.5" in line


@for_each(
    ("assignment", "named"),
    [
        ("end_time=3", "end_time is not a known key (did you mean solver.end_time?)"),
        ("stiffness=3", "(did you mean hinge_spring.stiffness or stop.stiffness or net.stiffness"),
        ("structure.diameter=8", "structure.diameter is not a known key (a closed, regular ring of "
         "N sections and aperture diameter D has half_bar = D sin(pi / N) / 2 - hinge_offset; "),
        ("solver.end_time=0,5", 'solver.end_time = "0,5" must be a finite number in s, without '
         "quotes: write 0.5"),
        ("solver.end_time=3s", "without quotes: write 3"),
        ("solver.end_time=0.5h", "must be a finite number in s, without quotes: write 1800"),
        ("limits.rod_stress=100MPa", "in Pa, without quotes: write 1e+08"),
        ("limits.tension=0.2kN", "in N, without quotes: write 200"),
        ("structure.half_bar=1028.7 mm", "in m, without quotes: write 1.0287"),
        ("structure.opening_angle=0.35 rad", "in deg, without quotes: write 20.0535"),
        ("structure.opening_angle=20 degrees", "in deg, without quotes: write 20"),
        ("structure.half_bar=3 kg", "in m, without quotes: write the number alone"),
        ("gravity=9.81", "must be a table: write gravity = { vector = [..., ..., ...] }"),
        ("solver.end_time=long", 'solver.end_time = "long" must be a finite number in s, without '),
        ("structure.closed=True", 'structure.closed = "True" must be true or false, without '
         "quotes: write true"),
        ("structure.closed=no", "write false"),
        ("boom=false", 'below it kind = "flexible" or "rigid", or boom = "none" to leave it out'),
        ("rods=ancf", 'rods = "ancf" must be a table: write [rods], and below it kind = "ancf"'),
        ("cables.upper.axial_stiffness=1e5", "cables.upper.winch is missing: give it a table"),
        ("cables.upper.winch.start_time=3", "cables.upper.winch.winding is missing: give it a "
         "table with its kind, one of commanded, constant,"),
        ('faults={kind="stuck-vjoint",section=3}', "must be a list of tables: write [[faults]]"),
    ],
)  # fmt: skip
def test_plausible_assignments_are_told_what_they_mean(assignment: str, named: str) -> None:
    assert named in refused("check", "ring18", "--set", assignment)


@for_each(
    ("lines", "named"),
    [
        ('"loads.force" = { mean = 0.01, standard_deviation = 0.001 }',
         "inputs.loads.force.kind is missing: say which kind it is"),
        ("loads.force = { mean = 0.01, standard_deviation = 0.001 }",
         "inputs.loads.force.kind is missing: say which kind it is"),
        ('"loads.force" = 0.02', "inputs.loads.force = 0.02 must be a table"),
        ('"loads.forse" = { kind = "uniform", low = 0.01, high = 0.02 }',
         "inputs: scene ring18: loads.forse is not a known key (did you mean force?)"),
        ('"force" = { kind = "uniform", low = 0.01, high = 0.02 }', "or loads.force?"),
        ("[set]\nworkers = 2", "workers is not a known key"),
        ('"loads.force" = { kind = "normal", mean = 0.01, sigma = 0.001 }',
         "standard_deviation); also missing: inputs.loads.force.standard_deviation"),
        ('"loads.force" = { kind = uniform, low = 0.01 }', 'correct that line, "loads.force" = {'),
        ("[requirements]\nasynchrony_max <= 12", "asynchrony_max <= 12: write asynchrony_max = "
         "{ max = 12, probability = ..., confidence = ... }"),
        ('[outputs]\nlast = "max(opening_angle, over="time")"', "opening_angle, over=\"time\")\": "
         "quotes within quotes are single ones, as over='time'"),
        ("[set]\nboom = none", 'boom = none: words need quotes: write boom = "none"'),
    ],
)  # fmt: skip
def test_plausible_campaigns_are_told_what_is_missing(
    lines: str, named: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    start = CAMPAIGN.partition("[inputs]")[0].replace("set = { solver.end_time = 0.5 }\n", "")
    path.write_text(f"{start.replace('truss2', 'ring18')}[inputs]\n{lines}\n")
    assert named in refused("campaign", path, "--workers", 0, "--out", tmp_path / "out")


def test_keys_that_belong_elsewhere_in_a_campaign_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(CAMPAIGN.replace("samples = 4", "sample = 4"))
    assert refused("campaign", path).endswith(
        "design.sample is not a known key (did you mean samples?)"
    )
    for line, named in (("samples = 4", "did you mean design.samples?"),
                        ("workers = 2", "ringsim campaign FILE --workers N")):  # fmt: skip
        path.write_text(f"{line}\n{CAMPAIGN}")
        assert named in refused("campaign", path)


@for_each("verb", ["run", "check", "campaign"])
def test_a_result_is_no_input(verb: str, tmp_path: Path) -> None:
    path = tmp_path / "old.nc"
    save(xr.Dataset({"a": ("x", np.arange(3.0))}), path)
    line = refused(verb, path)
    assert line.startswith("old.nc: this is a netCDF file, not a text: give the TOML file")


def test_places_without_a_campaign_are_told_apart(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(CAMPAIGN)
    for verb, place, named in (
        ("status", file, "this is a file"),
        ("merge", tmp_path / "nowhere", "there is no such folder"),
        ("status", tmp_path, "no campaign in this folder: it has no design.nc"),
    ):
        line = refused(verb, place)
        assert f"{place}: {named}: give the folder that ringsim campaign has written" in line
    assert "there is no such file" in refused("campaign", tmp_path / "nowhere.toml")


@for_each(
    ("words", "named"),
    [
        (("run", "truss2", "--accuracy", "1%"), "'1%' is not a valid number"),
        (("campaign", "a.toml", "--workers", "many"), "'many' is not a valid whole number"),
        (
            ("check", "truss2", "--margin", "--deploys-in", "9"),
            "--margin: not together with --deploys-in: leave out one of the two",
        ),
        (("check", "truss2", "--deploys-in", "-3"), "'--deploys-in': -3.0 is not in the range x>0"),
    ],
)
def test_bad_numbers_of_options_are_told_in_english(words: tuple[str, ...], named: str) -> None:
    done = preloaded.ringsim(*words)
    assert done.returncode == EXIT_BAD_INPUT
    assert named in done.stderr
    assert len(done.stderr.splitlines()) == 1


@for_each("verb", ["", *VERBS])
def test_help_reads_as_english(verb: str) -> None:
    text = ringsim(*verb.split(), "--help")
    assert "``" not in text
    assert not re.search(r"\b(TEXT|PATH|INTEGER|FLOAT|RANGE)\b(?!=)", text)


def terminal(*arguments: str) -> str:
    """What a command writes to stderr where that is a terminal."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 110))
    command = [sys.executable, "-m", "ringsim", *arguments]
    with subprocess.Popen(command, stderr=theirs, stdout=subprocess.DEVNULL) as process:
        os.close(theirs)
        told = b""
        try:
            while more := os.read(ours, 65536):
                told += more
        except OSError:  # how Linux says that the other side is closed
            pass
        finally:
            os.close(ours)
        assert process.wait() == 0
    return told.decode()


def test_a_run_on_a_terminal_shows_its_progress(tmp_path: Path) -> None:
    words = "run", "truss2", "--set", "solver.end_time=0.5", "--out", str(tmp_path / "t.nc")
    # Steps that take longer than the bar waits for what it shows next.
    told = terminal(*words, "--set", "solver.step=0.0005")
    assert "of 0.5 s" in told
    assert "0 of 4 V-joints locked" in told
    quiet = preloaded.ringsim(*words)
    assert (quiet.returncode, quiet.stderr) == (0, "")


def test_a_scene_file_without_its_ending_is_suggested(tmp_path: Path) -> None:
    (tmp_path / "ring5.toml").write_text(load_scene("ring18").to_toml())
    with pytest.raises(InputError) as refused:
        load_scene(tmp_path / "ring5")
    whole = tmp_path / "ring5"
    assert str(refused.value) == (
        f"{whole}: no such file, and no built-in scene of that name (did you mean {whole}.toml?)"
    )


def test_a_scene_file_that_is_misspelt_is_suggested_before_a_built_in_scene(tmp_path: Path) -> None:
    (tmp_path / "ring12.toml").write_text(load_scene("ring18").to_toml())
    with pytest.raises(InputError, match=r"did you mean \S*/ring12\.toml\?"):
        load_scene(tmp_path / "ring13.toml")
    with pytest.raises(InputError, match=r"did you mean ring18\?"):
        load_scene(Path("rong18"))


def test_refusals_of_campaigns_tell_the_cure(tmp_path: Path) -> None:
    """A normal friction goes below zero; percents are no probabilities."""
    path = tmp_path / "mine.toml"
    law = '{ kind = "normal", mean = 1e-6, standard_deviation = 0.002 }'
    path.write_text(f'{CAMPAIGN}"joints.vjoint.coulomb" = {law}\n')
    line = refused("campaign", path, "--dry-run")
    assert re.search(r"joints\.vjoint\.coulomb = -0\.\d{1,11} N m must be at least 0 N m: ", line)
    assert line.endswith('draw it with kind = "truncated", low = 0, of = { kind = "normal", ... }')
    # What another value of the scene bounds no end of a distribution cures.
    wide = law.replace("1e-6", "0.02")
    path.write_text(f'{CAMPAIGN}"rods.diagonal.inner_diameter" = {wide}\n')
    line = refused("campaign", path, "--dry-run")
    assert "must be below outer_diameter" in line
    assert "truncated" not in line
    soft = law.replace("1e-6", "0.49999")
    path.write_text(f'seed = 5\n{CAMPAIGN}"rods.poisson_ratio" = {soft}\n')
    line = refused("campaign", path, "--dry-run")
    assert 'draw it with kind = "truncated", high = 0.5, of =' in line
    wrong = law.replace("1e-6", "120.0")
    path.write_text(f'{CAMPAIGN}"rods.young_modulus" = {wrong}\n')
    line = refused("campaign", path, "--dry-run")
    assert line.endswith(
        "120 GPa are 1.2e+11 Pa; most of its distribution is beyond that: check its numbers"
    )
    wanted = "[requirements]\nasynchrony_max = { max = 9.0, probability = 95, confidence = 0.9 }"
    path.write_text(f"{CAMPAIGN}\n{wanted}\n")
    line = refused("campaign", path, "--dry-run")
    assert line.endswith("probability = 95 must be below 1; 95 % are 0.95")
    path.write_text(f"{CAMPAIGN}\n{wanted.replace('= 95', '= 1.0827989')}\n")
    assert refused("campaign", path, "--dry-run").endswith("1.0827989 must be below 1")
    own = "[outputs]\nmean_angle = { of = 'max(mean(opening_angel))' }"
    path.write_text(f"{CAMPAIGN}\n{own}\n{wanted.replace('asynchrony_max', 'mean_angle')}\n")
    line = refused("campaign", path, "--dry-run")
    assert line.endswith("did you mean opening_angle?); also at fault: "
                         "requirements.mean_angle.probability")  # fmt: skip
    path.write_text(path.read_text().replace("= 95", "= 0.95"))
    assert refused("campaign", path, "--dry-run").endswith("did you mean opening_angle?)")


@for_each(
    ("values", "text"),
    [
        ({"gravity.vector": [0, 0, 0]},
         "gravity.vector = [0.0, 0.0, 0.0] m/s^2 must not be zero: leave gravity out"),
        ({"gravity.vector": 9.81}, "gravity.vector = 9.81 m/s^2 must be a list of 3 numbers"),
        ({"spacecraft": {"mass": 1.0, "inertia": 2.0}},
         "spacecraft.inertia = 2.0 kg m^2 must be a list of 3 numbers"),
        ({"structure.angle_error": -10.0, "structure.opening_angle": 8.0},
         "angle_error = -10 deg must leave opening_angle = 8.0 deg between 1 and 179.9 deg: raise"),
        ({"structure.angle_error": 10.0, "structure.opening_angle": 175.0}, "deg: lower it"),
        ({"temperature.joint.value": [150.0] * 17 + [600.0],
          "temperature.joint.friction": {"temperatures": [100.0, 400.0], "factors": [2.0, 1.0]}},
         "temperature.joint.value = 600 K must lie within 100 .. 400 K, for which it has factors: "
         "extend temperature.joint.friction.temperatures"),
        ({"temperature.joint.value": 20.0,
          "temperature.joint.friction": {"temperatures": [200.0, 400.0], "factors": [2.0, 1.0]}},
         "20 K must lie within 200 .. 400 K, for which it has factors: 20 C are 293.15 K; or "),
        ({"offload.corners": [1, 3, 3], "boom.base": "fixed", "gravity.vector": [0, 0, -9.81]},
         "offload.corners[3] = 3 names a corner twice"),
    ],
)  # fmt: skip
def test_a_refusal_of_a_part_tells_value_and_cure(values: dict[str, object], text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        load_scene("ring18-motor").with_values(values)


DOUBTFUL = [
    ("cables.upper.block_offset=105", "block_offset = 105 m is larger than the shortest rod"),
    ("cables.upper.pulley_radius=0.3", "pulley_radius = 0.3 m is larger than the shortest rod"),
    ("cables.lower.winch.winding.drum_radius=2.0", "winding.drum_radius = 2 m is larger than"),
    ("cables.upper.winch.start_time=500.0", "start_time = 500 s is after solver.end_time"),
    ("cables.lower.winch.stop_time=500.0", "stop_time = 500 s is after solver.end_time"),
    ('faults=[{kind="stuck-vjoint",section=2,time=500.0}]', "faults[1].time = 500 s is after"),
    ("structure.corner_mass=50.0", "structure.corner_mass: corners of 1800 kg on rods of 1.287"),
    ("joints.vjoint.coulomb=5.0", "joints.vjoint.coulomb = 5 N m is above 1 N m: a pin of"),
    ("joints.pivot.coulomb=1.1", "joints.pivot.coulomb = 1.1 N m is above 1 N m"),
    ("record.stress=true limits.rod_stress=1.0", "limits.rod_stress = 1 Pa is below 1e+06 Pa"),
]
OTHERS = [
    # T = 6.4 N m * 100 * 0.6 / 0.02 m; v = 500 rad/s * 0.02 m / 0.001.
    ("cables.upper.winch.winding.stall_torque=6.4", "stalls at 1.92e+04 N of rope, above 10000 N"),
    ("cables.lower.winch.winding.gear_ratio=0.001", "winding winds up to 1e+04 m/s, above 10 m/s"),
    ("latch.peak_torque=0.02 latch.min_rate=5.0", "latch.min_rate = 5 rad/s is above 2 rad/s"),
    ("latch.reach=0.087", "latch.reach = 0.087 deg is below 0.2 deg"),
    ("record.stress=true limits.rod_stress=3e10", "limits.rod_stress = 3e+10 Pa is above 1e+10 Pa"),
    # E = 0.1 MPa on tubes of 10 x 9.15 mm, 12.79 mm^2.
    (
        "rods.young_modulus=1e5 rods.bar_young_modulus=120e9",
        "rods: the axial stiffness E A of the diagonals is 1.28 N, below 1000 N",
    ),
]


@for_each("doubtful", [[], DOUBTFUL, OTHERS])
def test_values_that_nobody_means_are_told_and_not_refused(doubtful: list[tuple[str, str]]) -> None:
    """Half a bar of ring18 has 0.289 m, its rods weigh 1.287 kg; a scene as it is has none.

    Each has a line of its own, however many there are.
    """
    settings = [word for given, _ in doubtful for each in given.split() for word in ("--set", each)]
    told = ringsim("check", "ring18-motor", *settings)
    lines = [line for line in told.splitlines() if line.startswith("doubtful: ")]
    assert len(lines) == len(doubtful), lines
    for _, words in doubtful:
        assert sum(words in line for line in lines) == 1, lines
    assert told.splitlines()[-1].startswith("valid")


def test_a_run_tells_them_too(tmp_path: Path) -> None:
    """It runs all the same."""
    settings = ["--set", "structure.corner_mass=30", "--out", str(tmp_path / "run.nc")]
    told = ringsim("run", "truss2", "--fidelity", "frame", *settings).splitlines()
    assert told[0] == "doubtful: structure.corner_mass: corners of 180 kg on rods of 0.143 kg"
    assert told[1].startswith("truss2: ok, deployed")


def test_options_that_no_help_lists_are_not_suggested(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["ringsim", "campaign", "--worker", "1", "file.toml"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == EXIT_BAD_INPUT
    told = capsys.readouterr().err
    assert "Did you mean '--workers'?" in told
    assert "--solver" not in told


def test_a_free_rope_in_millimetres_is_refused() -> None:
    told = refused("check", "ring18-cable", "--set", "limits.slack_length=50")
    assert "limits.slack_length = 50 m must be at most 1 m; 50 mm are 0.05 m" in told
