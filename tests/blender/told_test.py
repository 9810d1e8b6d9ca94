"""What the add-on tells the server and remembers, without Blender and without a server: told_test.py FOLDER_OF_THE_ADD_ON."""

import sys
import unittest

sys.path.insert(0, sys.argv.pop())
from told import Told  # noqa: E402


class Changes(unittest.TestCase):
    def setUp(self):
        self.told = Told()
        self.number = 0

    def tell(self, present):
        """What is sent of it, as one update."""
        news = self.told.news(present)
        if news:
            self.number += 1
            self.told.tell({key: present.get(key) for key in news}, self.number)
        return news

    def test_what_is_new_is_told_once(self):
        self.assertEqual(self.tell({"a": 1, "p": 2}), ["a", "p"])
        self.assertEqual(self.tell({"a": 1, "p": 2}), [])
        self.assertEqual(self.tell({"a": 3, "p": 2}), ["a"])
        self.assertEqual(self.tell({"p": 2}), ["a"])  # it is gone
        self.assertEqual(self.tell({"p": 2}), [])
        self.assertEqual(self.tell({"a": 3, "p": 2}), ["a"])

    def test_what_fell_with_a_refused_change_is_told_again_one_by_one(self):
        self.tell({"a": 1, "b": 1, "p": 1})
        self.told.answered(self.number)
        bad = {"a": 1, "b": "bad", "p": 2}
        self.assertEqual(self.tell(bad), ["b", "p"])
        self.told.refused()
        self.assertTrue(self.told.has_refusals)
        self.assertIsNone(self.told.last("b"))  # so that it is sent whole
        self.assertEqual(self.tell(bad), ["b"])
        self.assertEqual(self.tell(bad), [])  # until that is answered
        self.told.refused()
        self.assertEqual(self.tell(bad), ["p"])
        self.told.answered(self.number)
        self.assertEqual(self.tell(bad), [])  # and not b again
        self.assertTrue(self.told.has_refusals)
        self.assertEqual(self.tell({"a": 1, "b": "good", "p": 2}), ["b"])
        self.told.answered(self.number)
        self.tell({"a": 1, "b": "good", "p": 2})
        self.assertFalse(self.told.has_refusals)

    def test_a_handle_whose_move_was_refused_is_released_all_the_same(self):
        self.tell({"a": 1})
        self.told.answered(self.number)
        self.tell({"a": "bad"})
        self.told.refused()
        self.assertEqual(self.tell({}), ["a"])
        self.told.answered(self.number)
        self.assertEqual(self.tell({}), [])

    def test_what_was_answered_before_is_not_doubted(self):
        self.tell({"a": 1, "b": 1})
        self.told.answered(self.number)
        self.tell({"a": 1, "b": "bad"})
        self.told.refused()
        self.assertEqual(self.told.last("a"), 1)
        self.assertEqual(self.tell({"a": 1, "b": "bad"}), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
