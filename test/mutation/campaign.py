# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults tried one after the other, and what came of them."""

import collections
import concurrent.futures
import pathlib
import shutil
import tempfile
import time

import builds
import checks

EQUIVALENT = pathlib.Path(__file__).with_name("equivalent.txt")


def read_equivalent(path=EQUIVALENT):
    """{(file, function, line, changed line): reason}, from blocks of text."""
    entries = {}
    for block in path.read_text().split("\n\n"):
        lines = [line for line in block.splitlines() if not line.startswith("#")]
        if lines:
            place, before, after, *reason = lines
            path_name, _, function = place.partition(" ")
            if not reason:
                raise ValueError("no reason given for %r in %s" % (after[2:], path))
            entries[path_name, function, before[2:], after[2:]] = " ".join(reason)
    return entries


class Campaign:
    """Faults to try, until enough of them were real ones."""

    def __init__(self, variants, mutants, count, known):
        self.variants, self.mutants, self.count = variants, mutants, count
        self.known, self.skipped = known, collections.Counter()
        self.results = []  # (mutant, why it was caught or None)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="mutation-"))

    def check_pristine(self):
        """What fails without any fault would count as caught: name of the check."""
        paths = sorted({mutant.path for mutant in self.mutants})
        for check in dict.fromkeys(c for path in paths for c in checks.CHECKS[path]):
            variant = self.variants[check[0]]
            variant.prepare()
            why = checks.run_check(check, builds.ROOT / variant.out / variant.output)
            if why:
                return "%s: %s" % (" ".join(check), why)
        return None

    def try_one(self, mutant):
        """Why the tests fail on this fault (None: they do not), or a skip."""
        if mutant.key() in self.known:
            return "skip", "argued to change nothing"
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        programs = {}
        try:
            text = mutant.apply((builds.ROOT / mutant.path).read_text())
            for check in checks.CHECKS[mutant.path]:
                name = check[0]
                if name not in programs:
                    programs[name] = self.variants[name].build(
                        mutant.path, text, folder)
                if programs[name] is None:
                    continue
                why = checks.run_check(check, programs[name])
                if why:
                    return "caught", why
        except builds.CompileError:
            return "skip", "does not compile"
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        if not any(programs.values()):
            return "skip", "the same program"
        return "missed", None

    def note(self, mutant, start, result, why):
        if result == "skip":
            self.skipped[why] += 1
            return
        if len(self.results) == self.count:
            return
        self.results.append((mutant, why))
        print("[%3d/%d] %-6s %5.1f s  %s%s"
              % (len(self.results), self.count, result,
                 time.monotonic() - start, mutant,
                 "\n%30s%s" % ("by ", why) if why else ""), flush=True)

    def run(self, jobs):
        """Try faults in parallel until `count` results are there."""
        waiting, source = {}, iter(self.mutants)
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            while len(self.results) < self.count:
                while len(waiting) < jobs and (mutant := next(source, None)):
                    waiting[pool.submit(self.try_one, mutant)] = (
                        mutant, time.monotonic())
                if not waiting:
                    break
                done, _ = concurrent.futures.wait(
                    waiting, return_when=concurrent.futures.FIRST_COMPLETED)
                for future in done:
                    self.note(*waiting.pop(future), *future.result())
        shutil.rmtree(self.folder, ignore_errors=True)


def report(campaign):
    """Tables of what was caught; returns the number of caught faults."""
    for title, key in (("File", lambda m: m.path),
                       ("Operator", lambda m: m.operator)):
        rows = collections.defaultdict(lambda: [0, 0])
        for mutant, why in campaign.results:
            rows[key(mutant)][0] += why is not None
            rows[key(mutant)][1] += 1
        print("\n%-24s caught  of" % (title,))
        for name, (caught, total) in sorted(rows.items()):
            print("%-24s %6d %3d" % (name, caught, total))
    missed = [mutant for mutant, why in campaign.results if not why]
    if missed:
        print("\nNot caught:")
    for mutant in missed:
        print("%s %s\n- %s\n+ %s\n" % mutant.key())
    for why, count in campaign.skipped.items():
        print("passed over: %d, %s" % (count, why))
    return len(campaign.results) - len(missed)
