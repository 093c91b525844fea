# SPDX-License-Identifier: MIT
"""Each constant of the table in docs/diagnosis.md is in the file that it names, with the value that it names."""
import re
import unittest

import constants_table
import sensitivity_study


class Table(unittest.TestCase):
    def test_each_is_where_the_table_says(self):
        constants = constants_table.constants()
        self.assertGreater(len(constants), 80)
        compared = 0
        for constant in constants:
            if "*" in str(constant.file):
                continue
            with self.subTest(constant.key):
                text = (constants_table.ROOT / constant.file).read_text()
                self.assertRegex(text, rf"\b{constant.name}\b")
                said, found = constants_table.number(constant.said), constant.definition(text)
                if said is not None and found:
                    self.assertAlmostEqual(said, constants_table.number(found["value"]), places=9)
                    compared += 1
        print(f"{compared} of {len(constants)} constants have one number, the same in the table and in the code")
        self.assertGreater(compared, 80)

    def test_no_number_of_the_diagnosis_is_left_out(self):
        """What the diagnosis calls a constant is in the table, or among the accuracies below it."""
        below = constants_table.PAGE.read_text().split("\nThe rest are bounds", 1)[1].split("\n##", 1)[0]
        no_choice = {"kGolden", "kPer_mm", "kNone"}  # a ratio, a unit, an index
        named = no_choice | {c.name for c in constants_table.constants()} | set(re.findall(r"`(k\w+)`", below))
        numbers = 0
        for folder in ("inference", "needle", "mismatch"):
            for path in sorted((constants_table.ROOT / "diagnosis").glob(f"**/{folder}/*.[ch]pp")):
                for line in path.read_text().splitlines():
                    for name in re.findall(r"\b(k[A-Z]\w*) = [-+\d.]", line) if "constexpr" in line else []:
                        with self.subTest(file=path.name):
                            self.assertTrue(name in named, name)
                        numbers += 1
        self.assertGreater(numbers, 100)


class Study(unittest.TestCase):
    def test_half_twice_and_the_odds_of_shares(self):
        self.assertEqual(sensitivity_study.changed(3.5, 2, False), 7)
        self.assertEqual(sensitivity_study.changed(1, 0.5, True), 1)
        self.assertAlmostEqual(sensitivity_study.changed(0.75, 2, False), 6 / 7)
        self.assertAlmostEqual(sensitivity_study.changed(0.5, 0.5, False), 1 / 3)

    def test_every_second_program_is_the_mirror_of_the_one_before(self):
        constants = sensitivity_study.studied()
        self.assertGreater(len(constants), 50)
        one, other = sensitivity_study.programs_of(constants, 2, 7)
        for key, (_, text) in constants.items():
            value = constants_table.number(text)
            self.assertEqual(sum(p[key] > value for p in (one, other)), 1, key)

    def test_the_fewest_that_make_a_difference_are_found(self):
        keys = [f"k{i}" for i in range(50)]
        self.assertEqual(sensitivity_study.fewest(lambda some: "k31" in some, keys), ["k31"])
        both = sensitivity_study.fewest(lambda some: {"k3", "k44"} <= set(some), keys)
        self.assertEqual(both, ["k3", "k44"])


if __name__ == "__main__":
    unittest.main()
