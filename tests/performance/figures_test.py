"""The lines of deploy/bench.sh: a figure above its target, or none at all, is never called met."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import figures  # noqa: E402


class Figures(unittest.TestCase):
    targets = {"a": ("s", 2)}

    def test_a_figure_is_met_up_to_its_target_and_short_above(self):
        self.assertEqual(figures.line("a", 2, "s", self.targets), ("a, 2, s, <= 2, met", False))
        self.assertEqual(figures.line("a", 2.01, "s", self.targets), ("a, 2.01, s, <= 2, short", True))

    def test_no_number_is_short(self):
        self.assertTrue(figures.line("a", float("nan"), "s", self.targets)[1])

    def test_a_figure_without_a_target_is_only_shown(self):
        self.assertEqual(figures.line("b", 1, "s", self.targets), ("b, 1, s, -, -", False))


if __name__ == "__main__":
    unittest.main()
