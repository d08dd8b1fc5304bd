#!/usr/bin/env python3
"""Flies the rendezvous case study and draws its pictures (case_study/rendezvous_*.svg).

    test_suites/missions/make_rendezvous_page.py BUILD [--flights DIR] [--redraw] [--seeds N]
        [--runs N]

BUILD is a build folder with the programs rendezvous_test and rendezvous_images_test. Flights go to
DIR (BUILD/rendezvous); --redraw takes those that are there. Equal counts give equal files. Python
3.9, standard library.
"""

import argparse
import json
import math
import pathlib
import sys

sys.dont_write_bytecode = True
from figure import BLUE, ORANGE, RED, Figure
from make_page import PICTURES, fly, rows, seconds, start_ns

FAR = "RendezvousFarRangeCampaign.DirectionsAndBurnsShowTheRange"
NEAR = "InspectionImagesCampaign.FollowsATumblingTargetFromFrames"
WHOLE = "RendezvousCampaign.ArrivesFromThirtyKilometresThroughOutages"
RANGES_M = (30000, 25000, 20000, 15000, 10000, 6000, 4000, 3000, 2000)


def fly_all(build, flights, seeds, runs):
    program = build / "test_suites/missions/rendezvous_test"
    fly(program, FAR, flights / "single", "--orrery_run=0")
    fly(build / "test_suites/missions/rendezvous_images_test", NEAR, flights / "near",
        "--orrery_run=0", WHOLE_FLIGHT="1")
    fly(program, FAR, flights / "far", f"--orrery_runs={seeds}", "--orrery_record=off")
    fly(program, WHOLE, flights / "whole", f"--orrery_runs={runs}", "--orrery_record=off")


def flown(flights, part, test):
    path = flights / part / test / "runs.jsonl"
    return sorted((json.loads(line) for line in open(path, encoding="utf-8")),
                  key=lambda run: run["run"])


def single(flights, part, test):
    return next((flights / part / test).glob("seed-*"))


def navigation(run):
    """Hours, distance, error and sigma in three axes."""
    begin = start_ns(run)
    for row in rows(run / "navigation/chaser.csv"):
        error = [float(row[f"error_RTN_{a}_m"]) for a in "rtn"]
        sigma = [float(row[f"sigma_RTN_{a}_m"]) for a in "rtn"]
        yield seconds(row, "t_GPS_ns", begin) / 3600, error, sigma


def far_figure(flights):
    runs = flown(flights, "far", FAR)
    figure = Figure(820, 600)
    top = figure.axes(70, 36, 720, 240, x_range=(1.8, 36), y_range=(-3.2, 3.2), log_x=True,
                      y_step=1, x_label="range [km]", y_label="range error [%]",
                      title=f"Directions and burns alone, {len(runs)} seeds: error of the range")
    km, error, sigma = [], [], []
    for range_m in RANGES_M:
        errors = [r["metrics"][f"error_percent_at_{range_m}m"] for r in runs]
        sigmas = [r["metrics"][f"sigma_percent_at_{range_m}m"] for r in runs]
        km.append(range_m / 1e3)
        error.append(math.sqrt(math.fsum(e * e for e in errors) / len(errors)))
        sigma.append(math.fsum(sigmas) / len(sigmas))
        top.dots([(range_m / 1e3, e) for e in errors], BLUE)
    top.band([(x, -s, s) for x, s in zip(km, sigma)][::-1], ORANGE, 0.3, "1 sigma of the filter")
    for sign in (1, -1):
        top.line([(x, sign * e) for x, e in zip(km, error)][::-1], BLUE, 1.2,
                 "1 sigma of the errors" if sign > 0 else None)
        top.horizontal(3 * sign, RED, "asked: 3 %" if sign > 0 else "", anchor="start")
    top.legend(right=False, top_offset=16)
    samples = list(navigation(single(flights, "single", FAR)))[::6]
    last = samples[-1][0]
    low = figure.axes(70, 340, 720, 200, x_range=(0, last), y_range=(0.1, 1e5), log_y=True,
                      x_label="time since start [h]", y_label="3D error [m]",
                      title="Seed 1: error of the relative position over time")
    low.line([(t, math.hypot(*s)) for t, _, s in samples], ORANGE, 1.2, "1 sigma, 3D")
    low.line([(t, math.hypot(*e)) for t, e, _ in samples], BLUE, 1.0, "error, 3D")
    low.legend()
    figure.write(PICTURES / "rendezvous_far.svg")
    for x, e, s in zip(km, error, sigma):
        print(f"far: {x} km: error {e:.2f} %, sigma {s:.2f} %")


def channel(run, name):
    begin = start_ns(run)
    path = run / f"channels/{name}.csv"
    for row in rows(path):
        yield seconds(row, "t_GPS_ns", begin) / 3600, float(row[name.rsplit(".", 1)[1]])


def near_figure(flights):
    run = single(flights, "near", NEAR)
    samples = list(navigation(run))[::2]
    attitude = list(channel(run, "chaser.view.attitude_error_deg"))[::3]
    sigma = list(channel(run, "chaser.view.attitude_sigma_deg"))[::3]
    span = (0, samples[-1][0])
    figure = Figure(820, 460)
    top = figure.axes(70, 36, 720, 150, x_range=span, y_range=(1e-3, 10), log_y=True,
                      y_label="3D error [m]", x_numbers=False,
                      title="60 m to 15 m from a target that tumbles, from frames, seed 1")
    top.line([(t, math.hypot(*s)) for t, _, s in samples], ORANGE, 1.2, "1 sigma, 3D")
    top.line([(t, math.hypot(*e)) for t, e, _ in samples], BLUE, 1.0, "error, 3D")
    top.legend()
    low = figure.axes(70, 220, 720, 190, x_range=span, y_range=(1e-2, 100), log_y=True,
                      x_label="time since start [h]", y_label="attitude error [deg]")
    low.dots(attitude, BLUE, 1.2, 0.5, "error at an image")
    low.dots(sigma, ORANGE, 1.0, 0.5, "1 sigma")
    low.horizontal(2, RED, "asked of the median: 2 deg")
    low.legend()
    figure.text(790, 454, "gaps: the target in the Earth's shadow, or near the Sun", size=10, anchor="end")
    figure.write(PICTURES / "rendezvous_near.svg")


def whole_figure(flights):
    runs = flown(flights, "whole", WHOLE)
    good = [r for r in runs if r["outcome"] == "passed"]
    delta_v = [r["metrics"]["delta_v_mps"] for r in good]
    low, width = 0.9, 0.005
    counts = [0] * 32
    for value in delta_v:
        counts[min(max(int((value - low) / width), 0), len(counts) - 1)] += 1
    mean = math.fsum(delta_v) / len(delta_v)
    figure = Figure(820, 380)
    axes = figure.axes(70, 36, 720, 290, x_range=(low, low + width * len(counts)),
                       y_range=(0, max(counts) * 1.2), x_step=0.02, y_label="runs",
                       x_label="delta-v of the chaser [m/s]",
                       title=f"30 km to 20 m through outages: {len(good)} of {len(runs)} arrived")
    axes.bars([low + width * k for k in range(len(counts) + 1)], counts, BLUE)
    axes.vertical(mean, RED, f"mean {mean:.3f}")
    figure.write(PICTURES / "rendezvous_delta_v.svg")
    print(f"whole: {len(good)} of {len(runs)}, delta-v mean {mean:.3f}, {min(delta_v):.3f} to "
          f"{max(delta_v):.3f} m/s, nearest {min(r['metrics']['nearest_m'] for r in good):.1f} m")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--flights", type=pathlib.Path)
    parser.add_argument("--redraw", action="store_true", help="take the flights that are there")
    parser.add_argument("--seeds", type=int, default=20, help="of the far range")
    parser.add_argument("--runs", type=int, default=100, help="of the whole rendezvous")
    options = parser.parse_args()
    flights = options.flights or options.build / "rendezvous"
    if not options.redraw:
        fly_all(options.build.resolve(), flights, options.seeds, options.runs)
    PICTURES.mkdir(exist_ok=True)
    for draw in (far_figure, near_figure, whole_figure):
        draw(flights)


if __name__ == "__main__":
    main()
