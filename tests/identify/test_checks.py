"""Checks of logs before they are fitted: each finds what was planted, and nothing in a log that is as it should be."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.cli import main
from planarfriction.cli.output import history_columns, write_csv
from planarfriction.errors import FileError
from planarfriction.identify import Log
from planarfriction.identify.checks import (
    check_log,
    check_logs,
    check_sampling,
    with_findings,
)
from planarfriction.identify.logs import columns_of
from tests.support.identification_logs import (
    LAW,
    LOAD,
    PATCH,
    clean_log,
    excitation,
    fitted,
    noisy,
)
from tests.support.refusals import refused


@pytest.fixture(scope="module")
def log():
    return noisy(clean_log(*excitation(duration=1.0)), 1)


@pytest.fixture(scope="module")
def turning():
    """The contact turns by five radians, so that its axes leave those of the world."""
    time, twist = excitation(duration=1.0)
    twist[:, 2] = 6.0 * np.minimum(1.0, 3.0 * time)
    return noisy(clean_log(time, twist), 2)


def changed(log, twist=(1, 1, 1), wrench=(1, 1, 1), time=1.0, load=1.0):
    """The log with its columns times factors."""
    return Log(
        time * log.time, log.twist * twist, log.wrench * wrench, load * log.normal_force
    )


def rotated(vectors, angle):
    cos = np.cos(angle)
    sin = np.sin(angle)
    x, y, z = vectors.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z + 0 * x], -1)


def angle_of(log):
    return np.concatenate(
        [
            [0.0],
            np.cumsum(0.5 * (log.twist[1:, 2] + log.twist[:-1, 2]) * np.diff(log.time)),
        ]
    )


# ------------------------------------------------------------------------------------------------ what is planted


@pytest.mark.parametrize("signs", [(-1, -1, -1), (-1, -1, 1)])
def test_friction_that_drives_the_motion_is_refused(log, signs):
    words = (
        "fx, fy and tau of opposite sign"
        if signs[2] < 0
        else "fx and fy of opposite sign"
    )
    with refused(
        rf"against its motion \(it does with {words}\), got power > 0 in \d+ %"
    ):
        fitted(changed(log, wrench=signs), PATCH)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wrench": (1, 1, -1)}, "with tau of opposite sign"),
        ({"wrench": (1, -1, 1)}, "with fy of opposite sign"),
        ({"twist": (1, -1, -1)}, "as if z points down"),
        ({"twist": (1e3, 1e3, 1)}, "vx and vy in mm/s, or tau in N mm"),
        ({"twist": (1e2, 1e2, 1)}, "vx and vy in cm/s"),
        ({"twist": (1, 1, 180 / np.pi)}, "omega in deg/s"),
        ({"wrench": (1, 1, 1e3)}, "vx and vy in mm/s, or tau in N mm"),
        ({"twist": (1e3, 1e3, 1), "wrench": (1, 1, 1e3)}, "all lengths in mm"),
    ],
)
def test_directions_tell_signs_and_units(log, change, words):
    (finding, *_) = check_log(changed(log, **change), PATCH)
    assert str(finding).startswith(
        "wrench of log should point in the direction of friction on the patch"
    ), finding
    assert words in str(finding) and not finding.refuses


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 4, 2.5])
def test_axes_of_a_sensor_that_is_turned(log, angle):
    found = check_log(Log(log.time, log.twist, rotated(log.wrench, angle), LOAD), PATCH)
    assert [
        f"rotated by {-np.degrees(angle):.0f} deg" in str(finding) for finding in found
    ] == [True]


def test_axes_of_the_world(turning):
    angle = angle_of(turning)
    for name, log in {
        "twist": Log(turning.time, rotated(turning.twist, angle), turning.wrench, LOAD),
        "wrench": Log(
            turning.time, turning.twist, rotated(turning.wrench, angle), LOAD
        ),
    }.items():
        assert [
            f"if the {name} is in world axes" in str(finding)
            for finding in check_log(log, PATCH)
        ] == [True]


def test_a_patch_in_millimetres(log):
    with pytest.warns(UserWarning, match="lengths in metres"):
        patch = pf.ContactPatch.disc(10.0, cells=11)
    assert "the patch in mm" in str(check_log(log, patch)[0])


def test_millimetres_and_milliseconds_without_spin(log):
    """Only the way between two samples tells them where nothing turns."""
    straight = changed(log, twist=(1, 1, 0), wrench=(1, 1, 0))
    (speed,) = check_log(changed(straight, twist=(1e3, 1e3, 1)), PATCH)
    assert str(speed).startswith(
        "twist of log should be in m/s"
    ) and "vx and vy in mm/s" in str(speed)
    (time,) = check_log(changed(straight, time=1e3), PATCH)
    assert str(time).startswith("t of log should be in s") and "is it in ms?" in str(
        time
    )


def test_friction_against_load(log):
    (force,) = check_log(changed(log, load=1e-3), PATCH)
    assert str(force).startswith("normal_force of log should be in N, got friction of")
    torque = check_log(changed(log, wrench=(1, 1, 1e3)), PATCH)[-1]
    assert str(torque).startswith("tau of log should be in N m")


def test_friction_without_load(log):
    load = np.where(np.arange(len(log.time)) % 4 == 0, 0.0, LOAD)
    (found,) = check_log(Log(log.time, log.twist, log.wrench, load), PATCH)
    assert "be > 0 where there is friction (it is 0 in 250 samples)" in str(found)
    wrench = np.where(load[:, None] > 0.0, log.wrench, 0.0)
    assert check_log(Log(log.time, log.twist, wrench, load), PATCH) == []


def test_sampling_against_the_corner_of_the_bristles(log):
    """1 kHz shows damping up to 500 Hz: sigma_0 = 2e4 1/m with sigma_1 = 6.37 s/m."""
    assert check_sampling(log, 2e4, 7.0) is None
    assert "1e+03 Hz or more to determine sigma_1" in str(check_sampling(log, 2e4, 6.3))
    assert str(check_sampling(log, 2e4, 6.3)).endswith("got 1e+03 Hz")
    assert check_sampling(log, 2e4, 0.0) is None


def test_findings_stand_beside_the_estimates(log):
    """A torque of opposite sign: said, and not refused."""
    found = fitted(
        changed(log, wrench=(1, 1, -1)),
        PATCH,
        parameters=("mu_c",),
        start=LAW,
        starts=1,
    )
    assert any(
        "fit: wrench of log should point in the direction of friction on the patch"
        in str(each)
        for each in found.verdicts
    )
    slow = noisy(clean_log(*excitation(duration=1.0, rate=200.0)), 1)
    found = fitted(slow, PATCH, parameters=("sigma_0", "sigma_1"), start=LAW, starts=1)
    assert any(
        "samples of log should be taken at" in str(verdict)
        for verdict in found.verdicts
    )
    assert not found.identifiable("sigma_1") and found.identifiable("sigma_0")
    two = with_findings(dataclasses.replace(found, verdicts=()), [slow, log], ())
    assert two.identifiable("sigma_1")  # one log is fast enough


def test_sampling_is_no_matter_where_sigma_1_may_be_zero():
    """Its corner may then lie anywhere: no rate of 1e+11 Hz is asked for."""
    law = dataclasses.replace(LAW, sigma_1=0.0)
    log = noisy(clean_log(*excitation(duration=1.0, rate=200.0), law=law), 1)
    found = fitted(
        log,
        PATCH,
        parameters=("sigma_0", "sigma_1"),
        start=LAW,
        starts=1,
        model="reduced-published",
    )
    assert found.intervals()["sigma_1"][0] == 0.0 and not found.identifiable("sigma_1")
    assert not any("samples of log" in str(verdict) for verdict in found.verdicts)


# ------------------------------------------------------------------------------------------------ no false alarms


def test_nothing_is_found_in_good_logs(log, turning):
    time, twist = excitation(duration=0.6)
    spin = twist * [0, 0, 1]
    still = 5e-4 * twist
    off = pf.ContactPatch.points(
        [[0.03, 0.0], [0.022, 0.009], [0.024, -0.01]], [1.0, 2.0, 1.5]
    )
    good = {
        "growing sines": (log, PATCH),
        "turning": (turning, PATCH),
        "no spin": (noisy(clean_log(time, twist * [1, 1, 0]), 1), PATCH),
        "spin alone": (noisy(clean_log(time, spin), 1), PATCH),
        "never slips": (noisy(clean_log(time, still), 1), PATCH),
        "centre far off": (noisy(clean_log(time, twist, patch=off), 1), off),
        "200 Hz": (noisy(clean_log(*excitation(duration=2.0, rate=200.0)), 1), PATCH),
        "a fifth of noise": (noisy(log, 3, share=0.2), PATCH),
        "no torque sensor": (changed(log, wrench=(1, 1, 0)), PATCH),
        "patch of twice the size": (log, pf.ContactPatch.disc(0.02, cells=11)),
        "patch of half the size": (log, pf.ContactPatch.disc(0.005, cells=11)),
        "sensor 10 deg off": (
            Log(log.time, log.twist, rotated(log.wrench, 0.17), LOAD),
            PATCH,
        ),
        "stiff": (
            clean_log(
                time, twist, law=dataclasses.replace(LAW, sigma_0=1e6, sigma_1=800.0)
            ),
            PATCH,
        ),
    }
    for name, (each, patch) in good.items():
        assert check_logs([each], patch) == (), name


@pytest.mark.parametrize("kind", ["in_hand", "free_slide", "driven"])
def test_nothing_is_found_in_simulations(kind):
    patch = pf.ContactPatch.disc(0.01, cells=11)
    model = pf.ReducedModelPublished(
        patch,
        dataclasses.replace(LAW, sigma_0=1e5),
        surface=pf.LimitSurfaceEllipsoid(patch),
    )
    solution = pf.simulate(getattr(pf.scenes, kind)(model), save_every=2e-3)
    assert check_logs([Log.from_solution(solution)], patch) == ()


# ------------------------------------------------------------------------------------------------ simulate, identify


def pushed(seconds=0.6):
    """A small body on one pad, off its centre of mass and turned, pushed about so that it slides and spins."""
    model = pf.ReducedModelPublished(PATCH, LAW)
    t = np.arange(0.0, seconds + 1e-9, 2e-3)
    force = np.stack(
        [
            1.6 * np.sin(2 * np.pi * 2.3 * t) * (0.2 + t),
            1.1 * np.sin(2 * np.pi * 1.7 * t + 1.0) * np.minimum(1.0, 5.0 * t),
            0.012 * np.sin(2 * np.pi * 3.1 * t) * (0.3 + t),
        ],
        -1,
    )
    pad = pf.Contact(
        model, LOAD, mounted_on="body", position=(0.004, 0.002), angle=0.4, name="pad"
    )
    body = pf.Body(0.3, 3e-5, gravity=(0.0, 0.0))
    return pf.Scene(
        body,
        [pad],
        seconds,
        force=pf.Signal.sampled(t, force),
        save_every=1e-3,
        name="pushed",
    )


@pytest.fixture(scope="module")
def solution():
    return pf.simulate(pushed(), rtol=1e-7)


def test_a_simulation_gives_its_law_back(solution):
    """Twists between samples are taken as smooth, and forces jump: 1e-3 of the wrench, which moves gamma by 5 %."""
    begin = dataclasses.replace(LAW, mu_c=0.4)
    log = Log.from_solution(solution)
    found = fitted(
        log, PATCH, start=begin, starts=1, model="reduced-published", nuisance=()
    )
    expected = {
        name: getattr(LAW, name) for name in found.names if name != "contact_radius"
    }
    for name, value in expected.items():
        assert found.estimates[name] == pytest.approx(value, rel=0.08), name
    assert found.estimates["mu_c"] == pytest.approx(LAW.mu_c, rel=2e-3)
    radius = pf.ReducedModelPublished(PATCH, LAW).surface.contact_radius
    assert found.estimates["contact_radius"] == pytest.approx(radius, rel=2e-3)


@pytest.mark.parametrize("mounted_on", ["body", "world"])
def test_twists_of_contacts_are_what_a_point_of_the_body_does(solution, mounted_on):
    """Against the motion of the point itself: differences of its place in the world, over 2 ms."""
    scene = dataclasses.replace(
        solution.scene,
        contacts=[
            dataclasses.replace(solution.scene.contacts[0], mounted_on=mounted_on)
        ],
    )
    moved = dataclasses.replace(solution, scene=scene)
    x, y, theta = (solution.data[name].values for name in ("x", "y", "theta"))
    at = np.array([0.004, 0.002])
    twist = moved.contact_twist("pad")
    for i in range(100, 600, 97):
        cos = np.cos(theta[[i - 1, i, i + 1]])
        sin = np.sin(theta[[i - 1, i, i + 1]])
        if mounted_on == "world":  # the point of the body that is at `at` now
            dx = at[0] - x[i]
            dy = at[1] - y[i]
            inside = np.array([cos[1] * dx + sin[1] * dy, cos[1] * dy - sin[1] * dx])
            angle = 0.4
        else:
            inside = at
            angle = 0.4 + theta[i]
        places = np.stack(
            [
                x[i - 1 : i + 2] + cos * inside[0] - sin * inside[1],
                y[i - 1 : i + 2] + sin * inside[0] + cos * inside[1],
            ]
        )
        velocity = (places[:, 2] - places[:, 0]) / 2e-3
        axes = np.array(
            [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        )
        assert twist[i, :2] == pytest.approx(
            axes @ velocity, abs=2e-3 * np.abs(twist[:, :2]).max()
        )


def test_twist_under_a_prescribed_velocity_is_in_body_axes():
    model = pf.ReducedModelPublished(PATCH, LAW)
    pad = pf.Contact(
        model, LOAD, mounted_on="body", position=(0.1, 0.0), angle=np.pi / 2
    )
    velocity = pf.Signal.constant([0.03, 0.01, 2.0])
    scene = pf.Scene(
        pf.Body(1.0, 1.0, angle=0.7), [pad], 0.02, velocity=velocity, save_every=1e-3
    )
    twist = pf.simulate(scene).contact_twist()
    assert twist == pytest.approx(
        np.tile([0.21, -0.03, 2.0], (len(twist), 1)), abs=1e-12
    )


def test_contacts_are_chosen_by_name(solution):
    with refused("contact must be one of pad"):
        Log.from_solution(solution, "finger")
    with refused("solution must be a Solution"):
        Log.from_solution(solution.scene)
    pad = solution.scene.contacts[0]
    scene = dataclasses.replace(
        solution.scene,
        contacts=[pad, dataclasses.replace(pad, name="other")],
        t_end=0.02,
    )
    both = pf.simulate(scene)
    with refused(r"contact must be given if there are several \(pad, other\)"):
        Log.from_solution(both)
    assert Log.from_solution(both, "other").name == "pushed, other"


# ------------------------------------------------------------------------------------------------ files


def written(path, columns, separator=",", point="."):
    rows = [
        list(columns),
        *([repr(float(v)) for v in row] for row in zip(*columns.values(), strict=True)),
    ]
    path.write_text(
        "\n".join(
            [
                separator.join(rows[0]),
                *(separator.join(row).replace(".", point) for row in rows[1:]),
            ]
        )
    )
    return path


@pytest.mark.parametrize(
    ("separator", "point"),
    [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")],
)
def test_separators_and_other_names(log, tmp_path, separator, point):
    columns = columns_of(log)
    columns = dict(
        zip(
            (
                "Time",
                "VX",
                "Vy [m/s]",
                "OMEGA (rad/s)",
                "Fx [N]",
                "Fy",
                "tau [N m]",
                "FN",
            ),
            columns.values(),
            strict=True,
        )
    )
    read = Log.from_csv(written(tmp_path / "log.csv", columns, separator, point))
    assert all(
        np.array_equal(getattr(read, name), getattr(log, name))
        for name in ("time", "twist", "wrench", "normal_force")
    )


@pytest.mark.parametrize(
    ("headings", "words"),
    [
        (
            "t,vx,vy,omega,fx,fy,moment,normal_force",
            "has no column tau; found t, vx, vy, omega, fx, fy, moment, ",
        ),
        ("t,x,y,theta,fx,fy,tau", "has no column normal_force; found"),
        (
            "stamp,x,y,theta,a.vx,a.vy,a.omega,a.fx,a.fy,a.tau,a.fn",
            "has no column t; found",
        ),
        ("stamp,vx,vy,fx,fy,tau,fn", "has no column t, omega; found"),
        (
            "t,vx [ft/s],vy,omega,fx,fy,tau,fn",
            "column vx [ft/s] must be in m/s or a multiple of it, got ft/s",
        ),
        ("t,vx,Vx,vy,omega,fx,fy,tau,fn", "columns vx and Vx are the same"),
        (
            "t,a.vx,a.vy,a.omega,a.fx,a.fy,a.tau,a.fn,b.vx,b.vy,b.omega,b.fx,b.fy,b.tau,b.fn",
            "has the contacts a, b",
        ),
    ],
)
def test_columns_found_against_columns_needed(tmp_path, headings, words):
    path = tmp_path / "bad.csv"
    path.write_text(headings + "\n" + ",".join("0" for _ in headings.split(",")) + "\n")
    with pytest.raises(FileError) as error:
        Log.from_csv(path)
    assert words in str(error.value).replace("'", ""), str(error.value)


def test_a_contact_is_not_chosen_where_columns_name_none(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,vx,vy,omega,fx,fy,tau,normal_force\n0,0,0,0,0,0,0,1\n")
    with refused(
        r"contact must be left out: no column is named as pad\.vx, got 'pad'", FileError
    ):
        Log.from_csv(path, contact="pad")


def test_run_writes_logs_that_identify_reads(solution, tmp_path, capsys):
    columns = history_columns(solution)
    assert list(columns)[:7] == ["time", "x", "y", "theta", "vx", "vy", "omega"]
    path = tmp_path / "pushed.csv"
    write_csv(path, columns)
    read = Log.from_csv(path)
    direct = Log.from_solution(solution)
    assert np.array_equal(read.twist, direct.twist) and np.array_equal(
        read.wrench, direct.wrench
    )
    two = tmp_path / "two.csv"
    other = {
        name.replace("pad", "other"): 2 * values
        for name, values in columns.items()
        if "." in name
    }
    write_csv(two, columns | other | {"other.t": columns["time"] + 1.0})
    double = Log.from_csv(two, contact="other")
    # A contact may have its own clock.
    assert np.array_equal(double.twist, 2 * direct.twist) and double.time[0] == 1.0
    start = [
        f"--start={name}={getattr(LAW, name)}"
        for name in ("mu_s", "v_s", "gamma", "sigma_0", "sigma_1", "sigma_2")
    ]
    options = ["--parameters", "mu_c", "--starts", "1", "--patch", "disc", *start]
    assert main(["identify", str(two), "--contact", "pad", *options]) == 0
    assert "mu_c" in capsys.readouterr().out
    assert main(["identify", str(two), *options]) == 2
    assert "has the contacts other, pad: choose one of them" in capsys.readouterr().err


@pytest.mark.parametrize(
    "names",
    [
        (
            "t",
            "twist.linear.x",
            "twist.linear.y",
            "twist.angular.z",
            "force.x",
            "force.y",
            "torque.z",
            "force.z",
        ),
        (
            "t",
            "vx",
            "vy",
            "wz",
            "wrench.force.x",
            "wrench.force.y",
            "wrench.torque.z",
            "wrench.force.z",
        ),
        ("Time", "vx", "vy", "omega", "Fx", "Fy", "Mz", "Fz"),
        ("t", "vx", "vy", "omega", "/ft/force/x", "/ft/force/y", "Tz", "FZ"),
    ],
)
@pytest.mark.parametrize(
    "units", ["", "s,m/s,m/s,rad/s,N,N,N m,N\n", "[s],(m/s),[m/s],[rad/s],,N,[Nm],\n"]
)
def test_names_of_sensors_and_ros_and_units_below_them(log, tmp_path, names, units):
    path = written(
        tmp_path / "log.csv", dict(zip(names, columns_of(log).values(), strict=True))
    )
    head, _, rest = path.read_text().partition("\n")
    path.write_text(f"{head}\n{units}{rest}")
    read = Log.from_csv(path)
    assert all(
        np.array_equal(getattr(read, name), getattr(log, name))
        for name in ("twist", "wrench", "normal_force")
    )


def test_units_below_the_names_are_checked(log, tmp_path):
    path = written(tmp_path / "log.csv", columns_of(log))
    head, _, rest = path.read_text().partition("\n")
    path.write_text(f"{head}\ns,m/s,m/s,rad/s,N,N,lbf ft,N\n{rest}")
    with refused("column .tau .lbf ft.. must be in N m or a multiple of it", FileError):
        Log.from_csv(path)


def test_units_in_the_heading_are_converted(log, tmp_path):
    """Times in ms, speeds in mm/s, angles in degrees, torques in N mm, forces in N and mN."""
    headings = (
        "Time (ms),vx [mm/s],vy [cm/s],wz [deg/s],Fx [N],Fy [mN],tau [N mm],Fn [kN]"
    )
    per_unit = [1e3, 1e3, 1e2, 180.0 / np.pi, 1.0, 1e3, 1e3, 1e-3]
    columns = zip(headings.split(","), per_unit, columns_of(log).values(), strict=True)
    table = {heading: factor * column for heading, factor, column in columns}
    read = Log.from_csv(written(tmp_path / "log.csv", table))
    for name in ("time", "twist", "wrench", "normal_force"):
        assert getattr(read, name) == pytest.approx(getattr(log, name), rel=1e-12)
