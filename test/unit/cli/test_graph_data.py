# SPDX-License-Identifier: GPL-3.0-or-later
"""`klippy graph` on accelerometer data and bed meshes: what is drawn is there."""
import json
import math
import re

import pytest

from klippy import cli
from klippy.cli import accel_data, graph_mesh
from klippy.extras.shaper_defs import FAMILIES
from klippy.extras.shaper_kernels import DESIGNS, make_kernel

np = pytest.importorskip("numpy")
pytest.importorskip("matplotlib")
RATE, FREQ, LOSS = 3200., 47., 0.1


def ring(seconds=4., axis=0):
    """Rows of a resonator of FREQ that noise drives, along an axis; g along z."""
    random = np.random.default_rng(5)
    count, omega = int(RATE * seconds), 2. * math.pi * FREQ
    step = 1. / RATE
    place = speed = 0.
    values = []
    for push in random.normal(0., 2e5, count):
        change = push - omega * omega * place - 2. * LOSS * omega * speed
        speed += change * step
        place += speed * step
        values.append(-omega * omega * place)
    rows = np.zeros((count, 4))
    rows[:, 0] = 12. + np.arange(count) * step
    rows[:, 3] = 9810.
    rows[:, 1 + axis] += values
    return rows


def write_csv(path, names, rows):
    path.write_text("\n".join([names, *(",".join("%.6f" % v for v in row)
                                        for row in rows)]) + "\n")
    return str(path)


@pytest.fixture(scope="module")
def samples():
    return ring()


def read_titles(path):
    return re.findall(r"<!-- (.*?) -->", path.read_text())


def test_spectrum_keeps_the_power(samples):
    spectrum = accel_data.calc_spectrum(samples)
    area = float(np.sum(spectrum["psd_x"]) * spectrum["freq"][1])
    assert area == pytest.approx(float(np.var(samples[:, 1])), rel=0.1)
    assert spectrum["psd_y"].max() < 1e-6 * spectrum["psd_x"].max()
    peak = spectrum["freq"][np.argmax(spectrum["psd_x"])]
    assert peak == pytest.approx(FREQ, abs=4.)


def test_sine_stands_at_its_frequency():
    times = np.arange(0., 3., 1. / RATE)
    rows = np.column_stack([times, 100. * np.sin(2. * math.pi * 60. * times),
                            0. * times, 0. * times])
    spectrum = accel_data.calc_spectrum(rows)
    assert spectrum["freq"][np.argmax(spectrum["psd_x"])] == pytest.approx(60., abs=1.)
    area = float(np.sum(spectrum["psd_x"]) * spectrum["freq"][1])
    assert area == pytest.approx(100. ** 2 / 2., rel=0.02)


def shake(name, shaper_freq, freq, loss, n=4000):
    """What is left of a vibration that a smooth shaper's kernel drives.

    An oscillator that is stepped in time (Runge-Kutta); 1 for one impulse.
    """
    kernel = make_kernel(name, shaper_freq, loss)
    omega, step = 2. * math.pi * freq, 2. * kernel.half / n
    times = np.linspace(-kernel.half, kernel.half, 2 * n + 1)
    push = np.polynomial.polynomial.polyval(times / kernel.half, kernel.coeffs)
    push = push / kernel.half
    state = np.zeros(2)
    matrix = np.array([[0., 1.], [-omega ** 2, -2. * loss * omega]])
    for i in range(0, 2 * n, 2):
        a, b, c = ((0., push[k]) for k in (i, i + 1, i + 2))
        k1 = matrix @ state + a
        k2 = matrix @ (state + step / 2. * k1) + b
        k3 = matrix @ (state + step / 2. * k2) + b
        k4 = matrix @ (state + step * k3) + c
        state = state + step / 6. * (k1 + 2. * k2 + 2. * k3 + k4)
    place, speed = state
    turn = omega * math.sqrt(1. - loss ** 2)
    return math.hypot(speed + loss * omega * place, turn * place)


@pytest.mark.parametrize("name", sorted(DESIGNS))
def test_smooth_shapers_let_through_what_an_oscillator_shows(name):
    freqs = [20., 45., 50., 57., 90.]
    found = accel_data.calc_response(name, 50., freqs, LOSS)
    wanted = [shake(name, 50., freq, LOSS) for freq in freqs]
    assert found == pytest.approx(wanted, abs=1e-4)
    assert found[2] < 0.05


@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_shapers_let_little_through_at_their_frequency(name):
    at, far = accel_data.calc_response(name, 50., [50., 5.])
    assert at < 0.06 and far > 0.8


def test_fits_are_at_the_resonance(samples):
    fits = accel_data.fit_shapers(accel_data.calc_spectrum(samples))
    by_name = {fit.name: fit for fit in fits}
    assert set(by_name) == {*FAMILIES, *DESIGNS}
    assert all(by_name[name].remaining < by_name["zv"].remaining for name in DESIGNS)
    assert by_name["smooth_si"].remaining < by_name["smooth_zv"].remaining
    assert by_name["zv"].freq == pytest.approx(FREQ, abs=4)
    assert by_name["3hump_ei"].remaining < by_name["ei"].remaining < (
        by_name["zv"].remaining) < 0.3


def test_draws_raw_data(samples, tmp_path):
    path = write_csv(tmp_path / "raw.csv", "#time,accel_x,accel_y,accel_z",
                     samples[:6000])
    image = tmp_path / "raw.svg"
    assert cli.main(["graph", path, "-o", str(image)]) == 0
    titles = read_titles(image)
    assert {"x", "y", "z", "xyz", "Hz", "mm/s²", "let through"} <= set(titles)
    left = [title for title in titles if title.endswith("% left")]
    assert [title.split()[0] for title in left] == [*FAMILIES, *DESIGNS]
    # the axis of frequencies ends at 200 Hz
    assert "200" in titles and "250" not in titles


def test_draws_spectra(samples, tmp_path):
    spectrum = accel_data.calc_spectrum(samples)
    names = "freq,psd_x,psd_y,psd_z,psd_xyz"
    rows = np.column_stack([spectrum[name] for name in names.split(",")])
    path = write_csv(tmp_path / "psd.csv", names, rows)
    lines = (tmp_path / "psd.csv").read_text().splitlines()
    again = accel_data.make_spectrum(path, *accel_data.read_columns(path, lines))
    assert np.allclose(again["psd_x"], spectrum["psd_x"], rtol=1e-3, atol=1e-5)
    assert accel_data.fit_shapers(again)[0].freq == accel_data.fit_shapers(
        spectrum)[0].freq
    image = tmp_path / "psd.png"
    assert cli.main(["graph", path, "-o", str(image)]) == 0
    assert image.read_bytes().startswith(b"\x89PNG")


HEADER = "freq,psd_x,psd_y,psd_z,psd_xyz"


@pytest.mark.parametrize("text, wanted", [
    ("a,b\n1,2\n", "must begin with time,accel_x"),
    ("#time,accel_x,accel_y,accel_z\n1,2,x,4\n", ":2: '1,2,x,4' is no row"),
    ("#time,accel_x,accel_y,accel_z\n1,2,3,4\n1,2,3\n", "row 2 has 3 numbers"),
    ("#time,accel_x,accel_y,accel_z\n1,2,nan,4\n", "not finite"),
    ("#time,accel_x,accel_y,accel_z\n1,2,3,4\n", "needs at least 256"),
    ("freq,psd_x\n1,2\n2,3\n3,4\n", "no psd_y, psd_z, psd_xyz"),
    (HEADER + "\n", "no rows"),
    (HEADER + "\n" + "10,0,0,0,0\n20,0,0,0,0\n30,0,0,0,0\n", "nothing vibrates"),
    ("", "must begin with"),
])
def test_bad_data_is_told(text, wanted, tmp_path, capsys):
    path = tmp_path / "data.csv"
    path.write_text(text)
    assert cli.main(["graph", str(path), "-o", str(tmp_path / "x.png")]) == 1
    assert wanted in capsys.readouterr().err
    assert not (tmp_path / "x.png").exists()


# Meshes

PROFILE = """[printer]
kinematics: none

#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [bed_mesh default]
#*# version = 1
#*# points =
#*# \t0.100, 0.000, -0.050
#*# \t0.000, 0.025, 0.200
#*# x_count = 3
#*# y_count = 2
#*# min_x = 10
#*# max_x = 190
#*# min_y = 20.5
#*# max_y = 180
"""
ROWS = ((0.1, 0., -0.05), (0., 0.025, 0.2))


def test_mesh_of_a_config(tmp_path):
    mesh, = graph_mesh.read_config("printer.cfg", PROFILE)
    assert mesh == ("default", (10., 100., 190.), (20.5, 180.), ROWS)
    path, image = tmp_path / "printer.cfg", tmp_path / "mesh.svg"
    path.write_text(PROFILE)
    assert cli.main(["graph", str(path), "-o", str(image)]) == 0
    titles = read_titles(image)
    assert {"x, mm", "y, mm", "z, mm",
            "default: -0.050 to 0.200, range 0.250 mm"} <= set(titles)


def test_mesh_of_a_status(tmp_path):
    status = {"result": {"status": {"bed_mesh": {
        "profile_name": "pei", "mesh_min": [10, 20], "mesh_max": [190, 180],
        "probed_matrix": ROWS, "mesh_matrix": ROWS}}}}
    mesh, = graph_mesh.read_status(json.dumps(status))
    assert mesh == ("pei", (10., 100., 190.), (20., 180.), ROWS)
    path, image = tmp_path / "status.json", tmp_path / "mesh.png"
    path.write_text(json.dumps(status))
    assert cli.main(["graph", str(path), "-o", str(image)]) == 0
    assert image.read_bytes().startswith(b"\x89PNG")


def test_mesh_of_a_log(tmp_path):
    config = graph_mesh.read_config("x", PROFILE)
    lines = PROFILE.split("#*# DO NOT")[1].split("\n")[2:]
    text = "\n".join(["===== Config =====", *(line[4:] for line in lines),
                      "==================", ""])
    path, image = tmp_path / "klippy.log", tmp_path / "mesh.svg"
    path.write_text(text)
    assert cli.main(["graph", str(path), "--plots", "mesh", "-o", str(image)]) == 0
    assert any(title.startswith(config[0].name) for title in read_titles(image))


@pytest.mark.parametrize("change, wanted", [
    (("0.025, 0.200", "0.025"), "row 2 has 2 points, the first has 3"),
    (("0.025", "bad"), "is no number"), (("max_x = 190", "max_x = 1"), "is no area"),
    (("#*# min_y = 20.5\n", ""), "no option 'min_y'"),
    (("[bed_mesh default]", "[bed_mesh]"), "no section [bed_mesh <name>]")])
def test_bad_mesh_is_told(change, wanted, tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    assert change[0] in PROFILE
    path.write_text(PROFILE.replace(*change))
    assert cli.main(["graph", str(path), "-o", str(tmp_path / "x.png")]) == 1
    assert wanted in capsys.readouterr().err


@pytest.mark.parametrize("text, wanted", [
    ("{", "no JSON"), ("{}", "no bed_mesh"),
    ('{"probed_matrix": [[1, 2], [3, 4]]}', "incomplete"),
    ('{"probed_matrix": [[1]], "mesh_min": [0, 0], "mesh_max": [1, 1]}', "no mesh")])
def test_bad_status_is_told(text, wanted, tmp_path, capsys):
    path = tmp_path / "status.json"
    path.write_text(text)
    assert cli.main(["graph", str(path), "-o", str(tmp_path / "x.png")]) == 1
    assert wanted in capsys.readouterr().err


def test_one_file_at_a_time(tmp_path, capsys):
    path = tmp_path / "printer.cfg"
    path.write_text(PROFILE)
    assert cli.main(["graph", str(path), str(path)]) == 1
    assert "one such file" in capsys.readouterr().err
