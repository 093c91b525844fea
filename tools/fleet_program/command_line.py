# SPDX-License-Identifier: MIT
"""What the scripts say of a command line that they do not understand: the option, and the one that was probably meant."""
import argparse
import difflib
import sys

USAGE = 2


class Parser(argparse.ArgumentParser):
    def error(self, message):
        # argparse names what is missing before what is mistyped, which is often the same.
        known = [text for action in self._actions for text in action.option_strings]
        for word in (argument.split("=")[0] for argument in sys.argv[1:] if argument.startswith("--")):
            if word == "--":
                break
            if word not in known:
                near = difflib.get_close_matches(word, known, 1)
                message = f"unknown option {word}" + (f"; did you mean {near[0]}?" if near else "")
                break
        print(f"{self.prog}: {message}\n{self.prog}: --help says how it is used", file=sys.stderr)
        sys.exit(USAGE)
