# SPDX-License-Identifier: MIT
"""How far a fleet is: cases done of how many, the time so far, and what is expected to remain. As tools/common/progress_line
says it, by the same rules."""
import sys
import time

LEAST_DONE = 4  # before that, and before one of each worker, there is no evidence
LINE_EVERY_S = 10.0  # where every line is kept


def remaining_s(done, of, at_a_time, elapsed_s):
    """What remains if the other pieces go on as those that are done; None without evidence."""
    if done >= of:
        return 0.0
    if done < max(LEAST_DONE, at_a_time) or elapsed_s <= 0:
        return None
    return elapsed_s * (of - done) / done


def in_words(seconds):
    whole = int(max(seconds, 0.0) + 0.5)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def roughly(seconds):
    """Of what nobody knows to the second."""
    return f"{int(seconds / 60 + 0.5)} min" if 600 <= seconds < 3600 else in_words(seconds)


def text(done, of, at_a_time, elapsed_s):
    left_s = remaining_s(done, of, at_a_time, elapsed_s)
    return (f"{done} of {of} cases done, {in_words(elapsed_s)} so far"
            + (f", about {roughly(left_s)} left" if left_s else ""))


class Line:
    """One line that is rewritten where `out` is a terminal; else a line now and then, the first after LINE_EVERY_S."""

    def __init__(self, of, at_a_time, out=sys.stderr, clock=time.monotonic):
        self.of, self.at_a_time, self.out, self.clock = of, at_a_time, out, clock
        self.live, self.began_s = out.isatty(), clock()
        self.said_s, self.said, self.words = self.began_s, -1, ""

    def show(self, done, last=False):
        now_s = self.clock()
        if self.live:
            words = "fleet: " + text(done, self.of, self.at_a_time, now_s - self.began_s)
            print("\r" + words.ljust(len(self.words)), end="\n" if last else "", file=self.out, flush=True)
            self.words = words
            return
        due = now_s - self.said_s >= LINE_EVERY_S and done > self.said
        if due or (last and self.said >= 0):
            print("fleet: " + text(done, self.of, self.at_a_time, now_s - self.began_s), file=self.out, flush=True)
            self.said_s, self.said = now_s, done
