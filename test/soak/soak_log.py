# SPDX-License-Identifier: GPL-3.0-or-later
"""Every warning and error of a soak has to be explained by what was done."""
import logging
import re


class LogJudge(logging.Handler):
    """Keeps what no cause explains.

    A cause is a set of patterns that holds from begin() to end().
    """

    def __init__(self, always=()):
        super().__init__(logging.WARNING)
        self.always = [re.compile(text) for text in always]
        self.causes = []
        self.unexplained, self.n_explained = [], 0
        self.step = None

    def begin(self, step, patterns):
        """From now on these patterns are expected."""
        self.step = step
        self.causes = [re.compile(text) for text in patterns]

    def end(self):
        self.step, self.causes = None, []

    def emit(self, record):
        text = record.getMessage()
        if record.exc_info and record.exc_info[1] is not None:
            text += "\n%r" % (record.exc_info[1],)
        self.judge(text)

    def judge(self, text):
        """Judge one text of the log or of the terminal."""
        if any(cause.search(text) for cause in [*self.always, *self.causes]):
            self.n_explained += 1
        else:
            self.unexplained.append((self.step, text))
