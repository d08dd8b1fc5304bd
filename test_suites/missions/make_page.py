#!/usr/bin/env python3
"""Flies the case study and draws its pictures (case_study/*.svg), and Table 5 of README.md.

    test_suites/missions/make_page.py BUILD [--flights DIR] [--redraw] [--runs N] [--seeds N] [--table5]

BUILD is a build folder with the programs visors_test, regression_cone_program_memory and, for
Table 5, bench_formation_gnc. Flights go to DIR (BUILD/case_study); --redraw takes those that are there.
Equal counts give equal files; run times of Table 5 are measured, and so differ, and are taken anew
only with --table5. A flight that fails is drawn as it was, says so in its picture, and makes the
command fail in the end. Python 3.9, standard library.
"""

import argparse
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
from figure import BLUE, GREEN, GREY, ORANGE, RED, Figure

HERE = pathlib.Path(__file__).resolve().parent
PICTURES = HERE / "case_study"
# The slew of the optics, the blackout and the orbit of visors_test.cpp [s].
SLEW_S, TIPPED_S, BACK_S, SILENT_S, ORBIT_S = 2296, 2446, 2806, 300, 5739

NAVIGATION = "Seeds/VisorsNavigationTest.FindsTheIntegersAndStandsASlewWithABlackout/0"
TRANSFER = "VisorsTransferCampaign.ReachesTheScienceOrbitInTwentyHoursAtTheExpectedCost"
SCIENCE = "Seeds/VisorsCampaignTest.ObservesEveryThirdOrbit/*"
HEAP = "VisorsFaultsTest.TheHeapDoesNotGrowAndStaysBelowTwoAndAHalfMegabytes"
SILENT_DEFECT = "VisorsDefectsTest.TransitionsWithoutRetransmissionCrashThePassiveSide"
ORDER_DEFECT = "VisorsDefectsTest.AQueueThatAssumesOrderCrashesOnAnOvertakenMeasurement"
GROWTH = "ConeProgramMemoryTest.MemoryGrowsInProportionToTheCandidates"


# ---- flights

def fly(program, tests, out, *flags, **variables):
    out.mkdir(parents=True, exist_ok=True)
    command = [str(program), f"--gtest_filter={tests}", f"--orrery_out={out}", "--orrery_seed=1",
               *flags]
    print(" ".join(command), flush=True)
    with open(out / "stdout.txt", "w", encoding="utf-8") as log:
        subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False,
                       env=dict(os.environ, **variables))
    text = output(out)
    if "[==========]" not in text or "Global test environment tear-down" not in text:
        sys.exit(f"make_page: did not end, see {out / 'stdout.txt'}")


def output(out):
    return (out / "stdout.txt").read_text(encoding="utf-8")


def tests_of(text, verdict):
    """Of the outcome of each test; the summary at the end says the names again, without a time."""
    return re.findall(rf"^\[ *{verdict} *\] (\S+?),? .*\(\d+ ms\)$", text, re.MULTILINE)


def note_red(figure, text, x=790, y=14):
    """What failed in the flights of a picture, in it."""
    red = tests_of(text, "FAILED")
    if red:
        figure.text(x, y, f"{len(red)} of {len(red) + len(tests_of(text, 'OK'))} tests failed",
                    colour=RED, anchor="end")


def fly_all(build, flights, runs, seeds):
    visors = build / "test_suites/missions/visors_test"
    cone = build / "test_suites/regressions/regression_cone_program_memory"
    fly(visors, f"{NAVIGATION}:{HEAP}:{SILENT_DEFECT}:{ORDER_DEFECT}", flights / "single")
    fly(cone, GROWTH, flights / "single_cone")
    fly(visors, TRANSFER, flights / "transfer", f"--orrery_runs={runs}", "--orrery_record=off")
    fly(visors, SCIENCE, flights / "science", f"--orrery_runs={seeds}", "--orrery_record=off")


def folder(flights, part, test, run="seed-1"):
    return flights / part / test.replace("/", "-") / run


def rows(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def seconds(row, key, start_ns):
    return (int(row[key]) - start_ns) * 1e-9


def start_ns(run):
    return json.loads((run / "summary.json").read_text(encoding="utf-8"))["start_GPS_ns"]


# ---- figure 23

def navigation_figure(flights):
    run = folder(flights, "single", NAVIGATION)
    begin = start_ns(run)
    samples = []
    for row in rows(run / "navigation/osc.csv"):
        samples.append((seconds(row, "t_GPS_ns", begin) / 60,
                        [1e3 * float(row[f"error_RTN_{a}_m"]) for a in "rtn"],
                        [1e3 * float(row[f"sigma_RTN_{a}_m"]) for a in "rtn"]))
    figure = Figure(820, 640)
    whole = (0, ORBIT_S / 60)
    total = figure.axes(70, 36, 720, 170, x_range=whole, y_range=(0.1, 1e4), log_y=True,
                        y_label="3D error [mm]", x_numbers=False, x_step=10,
                        title="Relative navigation of the optics over one orbit, seed 1")
    mark_events(total, True)
    total.line([(t, math.hypot(*s)) for t, _, s in samples], ORANGE, 1.2, "1 sigma, 3D")
    total.line([(t, math.hypot(*e)) for t, e, _ in samples], BLUE, 1.2, "error, 3D")
    total.horizontal(10, RED, "1 cm", anchor="start")
    total.legend()
    for k, axis in enumerate(("radial", "along-track", "cross-track")):
        last = k == 2
        axes = figure.axes(70, 226 + 124 * k, 720, 108, x_range=whole, y_range=(-6, 6), y_step=3,
                           y_label=f"{axis} [mm]", x_numbers=last, x_step=10,
                           x_label="time since start [min]" if last else "")
        mark_events(axes, False)
        axes.band([(t, -s[k], s[k]) for t, _, s in samples], ORANGE, 0.3, "1 sigma")
        axes.line([(t, e[k]) for t, e, _ in samples], BLUE, 1.0, "error")
        if k == 0:
            axes.legend()
    note_red(figure, output(flights / "single"))
    figure.write(PICTURES / "navigation.svg")


def mark_events(axes, named):
    axes.span(TIPPED_S / 60, BACK_S / 60, GREY)
    axes.span(TIPPED_S / 60, (TIPPED_S + SILENT_S) / 60, RED)
    if named:
        for row, (text, colour) in enumerate((("antenna 75 deg off zenith for 6 min", GREY),
                                              ("crosslink silent for 5 min", RED))):
            axes.label(axes.x(BACK_S / 60) + 5, axes.box[1] + 14 + 14 * row, text, colour)


# ---- figure 24

def transfer_figure(flights):
    folder_ = flights / "transfer" / TRANSFER
    runs = [json.loads(line) for line in open(folder_ / "runs.jsonl", encoding="utf-8")]
    runs.sort(key=lambda run: run["run"])
    delta_v = [run["metrics"]["delta_v_mps"] for run in runs]
    text = output(flights / "transfer")
    joint, separate = map(float, re.search(r"bounds ([\d.]+) joint, ([\d.]+) separate",
                                           text).groups())
    low, width = 0.21, 0.0025
    counts = [0] * 76
    for value in delta_v:
        counts[min(max(int((value - low) / width), 0), len(counts) - 1)] += 1
    figure = Figure(820, 390)
    axes = figure.axes(70, 36, 720, 300, x_range=(low, low + width * len(counts)),
                       y_range=(0, max(counts) * 1.25), x_label="delta-v of the optics [m/s]",
                       y_label="runs", x_step=0.02,
                       title=f"Standby to science in 20 h: {len(delta_v)} dispersed runs")
    axes.bars([low + width * k for k in range(len(counts) + 1)], counts, BLUE)
    mean = math.fsum(delta_v) / len(delta_v)
    deviation = math.sqrt(math.fsum((v - mean) ** 2 for v in delta_v) / (len(delta_v) - 1))
    axes.vertical(joint, GREEN, f"joint bound {joint:.4f}", anchor="end")
    axes.vertical(mean, RED, f"mean {mean:.4f}, sigma {deviation:.4f}")
    axes.vertical(separate, GREEN, f"separate bound {separate:.4f}")
    axes.vertical(1.2 * separate, GREY, f"limit of the mean {1.2 * separate:.4f}", at_top=False,
                  anchor="end")
    note_red(figure, text)
    figure.write(PICTURES / "transfer.svg")
    print(f"transfer: mean {mean:.4f} m/s, sigma {deviation:.4f}, {min(delta_v):.4f} to "
          f"{max(delta_v):.4f}, {sum(r['outcome'] == 'passed' for r in runs)} of {len(runs)} passed")


# ---- observations

OBSERVATION = re.compile(r"observation +\d+ at +(\d+) s: longitudinal +(-?[\d.]+) mm, "
                         r"lateral +([\d.]+) mm, +([\d.]+) mm/s(, good)?")


def science_figure(flights):
    text = output(flights / "science")
    found = [(float(x), float(y), float(v), bool(good))
             for _, x, y, v, good in OBSERVATION.findall(text)]
    seeds = len(tests_of(text, "OK")) + len(tests_of(text, "FAILED"))
    figure = Figure(820, 400)
    left = figure.axes(70, 36, 330, 300, x_range=(-20, 20), y_range=(0, 24), x_step=5, y_step=6,
                       x_label="longitudinal error [mm]", y_label="lateral offset [mm]",
                       title=f"{len(found)} observations in {seeds} campaigns: the worst of each")
    for x in (-15, 15):
        left.line([(x, 0), (x, 18)], RED, 1.3, dash="4 3")
    left.line([(-15, 18), (15, 18)], RED, 1.3, "limits", dash="4 3")
    left.dots([(x, y) for x, y, _, _ in found], BLUE, name="observation")
    left.legend()
    width = 0.005
    counts = [0] * 44
    for _, _, v, _ in found:
        counts[min(int(v / width), len(counts) - 1)] += 1
    right = figure.axes(466, 36, 324, 300, x_range=(0, 0.22), y_range=(0, max(counts) * 1.2),
                        x_label="lateral velocity [mm/s]", y_label="observations", x_step=0.05)
    right.bars([width * k for k in range(45)], counts, BLUE)
    right.vertical(0.2, RED, "limit", anchor="end")
    note_red(figure, text)
    figure.write(PICTURES / "observations.svg")
    print(f"science: {sum(g for *_, g in found)} of {len(found)} good, "
          f"{max(abs(x) for x, *_ in found)} mm, {max(f[1] for f in found)} mm, "
          f"{max(f[2] for f in found)} mm/s")


# ---- figures 25 to 27

def showing_seed(flights, test):
    """The last seed that flew, defect and fixed: the one that shows it."""
    runs = sorted((flights / "single" / test).glob("seed-*.rep1"),
                  key=lambda p: int(p.name[5:].split(".")[0]))
    fixed = runs[-1]
    return fixed.with_name(fixed.name.split(".")[0]), fixed


def crash_s(run, spacecraft):
    crashes = rows(run / f"channels/{spacecraft}.flight.crash.csv")
    return seconds(crashes[0], "t_GPS_ns", start_ns(run)) if crashes else None


def packets(run, link):
    begin = start_ns(run)
    for row in rows(run / f"links/{link}.csv"):
        received = row["received_GPS_ns"]
        yield (seconds(row, "sent_GPS_ns", begin),
               seconds(row, "received_GPS_ns", begin) if received else None, int(row["bytes"]))


def exchange(axes, flown, sender, window, colour_of):
    """Packets as lines from who sends (above) to who receives; lost ones end on the way.

    colour_of(sent, size): None leaves a packet out.
    """
    low, high = window
    top, bottom = 1.0, 0.0
    shown = [(colour_of(sent, size), sent, received) for sent, received, size in flown]
    for colour, sent, received in sorted(shown, key=lambda one: one[0] != PALE):
        if colour is None or not low <= sent <= high:
            continue
        width = 1.0 if colour == PALE else 1.8
        if received is None:
            axes.line([(sent, top), (sent, 0.5)], colour, width)
            axes.cross(sent, 0.5, GREY if colour == PALE else RED, 3 if colour == PALE else 5)
        else:
            axes.line([(sent, top), (received, bottom)], colour, width)
    axes.label(axes.box[0] - 8, axes.y(top) + 4, sender[0], anchor="end")
    axes.label(axes.box[0] - 8, axes.y(bottom) + 4, sender[1], anchor="end")


PALE = "#b5c7d3"


def lanes(figure, box, window, title, x_label):
    axes = figure.axes(*box, x_range=window, y_range=(-0.25, 1.2), y_step=10, y_numbers=False,
                       title=title, x_label=x_label)
    for y in (0, 1):
        axes.line([(window[0], y), (window[1], y)], GREY, 0.8)
    return axes


def crash_mark(axes, at, text, anchor="start"):
    axes.cross(at, 0, "#000", 6)
    axes.note(at, 0, text, anchor=anchor, dx=10 if anchor == "start" else -10, dy=16)


def silent_figure(flights):
    defect, fixed = showing_seed(flights, SILENT_DEFECT)
    at = crash_s(defect, "osc")
    lost = max(t for t, received, size in packets(defect, "dsc-osc")
               if size == 77 and received is None and t < at)
    window = (lost - 20, at + 20)
    figure = Figure(820, 390)
    for row, (run, title) in enumerate(((defect, "Announced once: the passive side crashes"),
                                        (fixed, "Sent again until acknowledged"))):
        axes = lanes(figure, (110, 36 + 170 * row, 680, 120), window,
                     f"{title} ({run.name.split('.')[0]})",
                     "time since start [s]" if row else "")
        exchange(axes, packets(run, "dsc-osc"), ("detector", "optics"), window,
                 lambda _, size: BLUE if size == 77 else PALE)
        if row:
            heard = min(r for t, r, size in packets(run, "dsc-osc")
                        if size == 77 and r is not None and r >= lost)
            axes.note(heard, 0, "the optics hear of the change of mode", dx=4, dy=16)
        else:
            axes.note(lost, 0, "the announcement is lost", dx=6, dy=16)
            crash_mark(axes, at, "assert: committed for a minute to what it never heard of", "end")
    figure.text(790, 384, "blue: announcement of a change of mode; grey: measurements, whose header "
                "says what is committed; crosses: lost", size=10, anchor="end")
    figure.write(PICTURES / "no_retransmission.svg")


def order_figure(flights):
    defect, fixed = showing_seed(flights, ORDER_DEFECT)
    spacecraft = next(s for s in ("dsc", "osc") if crash_s(defect, s) is not None)
    link = "osc-dsc" if spacecraft == "dsc" else "dsc-osc"
    names = ("optics", "detector") if spacecraft == "dsc" else ("detector", "optics")
    at = crash_s(defect, spacecraft)
    window = (at - 60, at + 40)
    overtaken = max(t for t, r, _ in packets(defect, link) if r is not None and abs(r - at) < 1e-3)
    figure = Figure(820, 390)
    for row, (run, title) in enumerate(((defect, "A queue that assumes order: crash"),
                                        (fixed, "Late measurements are replayed"))):
        axes = lanes(figure, (110, 36 + 170 * row, 680, 120), window,
                     f"{title} ({run.name.split('.')[0]})",
                     "time since start [s]" if row else "")
        exchange(axes, packets(run, link), names, window,
                 lambda t, size: None if size < 190 else RED if t == overtaken else BLUE)
        if not row:
            crash_mark(axes, at, "assert: older than the newest measurement")
    figure.text(790, 384, "measurements at one per 10 s; red: the one that is overtaken", size=10,
                anchor="end")
    figure.write(PICTURES / "ordered_queue.svg")


# ---- figures 28 to 30

def memory_figure(flights):
    run = folder(flights, "single", HEAP)
    begin = start_ns(run)
    figure = Figure(820, 400)
    left = figure.axes(70, 36, 380, 310, x_range=(0, 320), y_range=(0, 2.6), y_step=0.5,
                       x_label="time since start [min]", y_label="heap [MB]",
                       title="The whole package in flight, seed 1")
    for name, label, colour, dash in (("osc", "optics", BLUE, None),
                                      ("dsc", "detector", GREEN, "5 4")):
        calls = [(seconds(r, "t_GPS_ns", begin) / 60, int(r["resting_bytes"]) * 1e-6,
                  int(r["transient_peak_bytes"]) * 1e-6) for r in rows(run / f"heap/{name}.csv")]
        calls = [one for one in calls if one[1] > 0]  # the last gives everything back
        plans = [one for one in calls if one[2] > one[1] + 0.01]
        for t, rest, peak in plans:
            left.line([(t, rest), (t, peak)], colour, 1.4)
        if plans:
            left.dots([(t, peak) for t, _, peak in plans], colour, 3, 1,
                      f"{label}: transient of a plan")
        left.line(thinned([(t, rest) for t, rest, _ in calls]), colour, 1.8, f"{label}: resting",
                  dash)
    left.horizontal(2.5, RED)
    left.label(left.x(4), left.y(2.5) + 13, "budget 2.5 MB", RED)
    left.legend(top_offset=24)
    metrics = json.loads((folder(flights, "single_cone", GROWTH) / "summary.json").read_text(
        encoding="utf-8"))["metrics"]
    sparse = sorted((int(key.rsplit("_", 1)[1]), value * 1e-6) for key, value in metrics.items())
    right = figure.axes(526, 36, 264, 310, x_range=(100, 1000), y_range=(0.1, 200), log_y=True,
                        log_x=False, x_step=200, x_label="candidate impulses",
                        y_label="planner's heap [MB]", title="Dense and sparse inequalities")
    dense = [(n, 160e-6 * n * n) for n in range(100, 1001, 20)]
    right.line(dense, ORANGE, 1.6, "dense G alone: 160 N² bytes")
    right.line(sparse, BLUE, 1.6, "sparse: the whole plan, measured")
    right.dots(sparse, BLUE, 3, 1)
    right.dots([(600, 57.6)], ORANGE, 3.5, 1)
    right.note(600, 57.6, "57.6", dx=6, dy=14)
    right.note(sparse[-1][0], sparse[-1][1], f"{sparse[-1][1]:.2f}", dx=8, dy=4)
    right.horizontal(50, RED, "cap 50 MB", anchor="start")
    right.legend(right=False, top_offset=268)
    figure.write(PICTURES / "memory.svg")


def thinned(points):
    """Without those between equal neighbours."""
    return [p for k, p in enumerate(points)
            if k in (0, len(points) - 1) or not points[k - 1][1] == p[1] == points[k + 1][1]]


# ---- Table 5

def table5(build):
    bench = build / "test_suites/bench/flight_sw/formation_gnc/bench_formation_gnc"
    command = [str(bench), "--benchmark_filter=BM_Navigation_(TimeUpdate|GraphicUpdate|SdcpUpdate|"
               "IntegerResolution|FilterEpoch)$", "--benchmark_repetitions=10", "--benchmark_min_time=0.05",
               "--benchmark_enable_random_interleaving=true", "--benchmark_format=json"]
    result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    times = {}
    for one in result["benchmarks"]:
        if one["run_type"] == "iteration":
            unit = {"ns": 1e-3, "us": 1.0, "ms": 1e3}[one["time_unit"]]
            times.setdefault(one["run_name"].split("_")[-1], []).append(
                (one["cpu_time"] * unit, one["max_us"]))
    names = (("TimeUpdate", "time update"), ("GraphicUpdate", "GRAPHIC update"),
             ("SdcpUpdate", "SDCP update"), ("IntegerResolution", "integer resolution (IAR)"),
             ("FilterEpoch", "whole epoch"))
    # Others use the machine, too: the least disturbed repetition beside what all of them gave.
    lines = ["| per epoch of 12 satellites | mean [us], least | median | max [us], least | all |",
             "|---|---|---|---|---|"]
    for key, name in names:
        means, longest = (sorted(values) for values in zip(*times[key]))
        lines.append(f"| {name} | {means[0]:.1f} | {means[len(means) // 2]:.1f} | "
                     f"{longest[0]:.0f} | {longest[-1]:.0f} |")
    page = HERE / "README.md"
    text = page.read_text(encoding="utf-8")
    head, rest = text.split("<!-- table 5 -->\n", 1)
    tail = rest.split("<!-- end of table 5 -->", 1)[1]
    page.write_text(head + "<!-- table 5 -->\n" + "\n".join(lines) +
                    "\n<!-- end of table 5 -->" + tail, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--flights", type=pathlib.Path)
    parser.add_argument("--redraw", action="store_true", help="take the flights that are there")
    parser.add_argument("--runs", type=int, default=100, help="transfers")
    parser.add_argument("--seeds", type=int, default=20, help="campaigns of ten observations")
    parser.add_argument("--table5", action="store_true", help="measure run times, too")
    options = parser.parse_args()
    flights = options.flights or options.build / "case_study"
    if not options.redraw:
        fly_all(options.build.resolve(), flights, options.runs, options.seeds)
    PICTURES.mkdir(exist_ok=True)
    for draw in (navigation_figure, transfer_figure, science_figure, silent_figure, order_figure,
                 memory_figure):
        draw(flights)
    if options.table5:
        table5(options.build)
    red = [name for part in ("single", "single_cone", "transfer", "science")
           for name in tests_of(output(flights / part), "FAILED")]
    if red:
        sys.exit("make_page: drawn, but failed: " + ", ".join(red))


if __name__ == "__main__":
    main()
