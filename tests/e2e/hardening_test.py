"""The programs are compiled with hardening against hostile input; CMakeLists.txt lists the options."""

import re
import subprocess
import unittest

import programs


def readelf(option, program):
    return subprocess.run(["readelf", "--wide", option, program], capture_output=True, text=True, check=True).stdout


class Hardening(unittest.TestCase):
    def test_each_program_lies_anywhere_in_memory(self):
        for program in (programs.server(), programs.cli()):
            self.assertIn("DYN (Position-Independent Executable file)", readelf("--file-header", program))

    def test_what_the_loader_writes_is_read_only_afterwards_and_no_stack_runs(self):
        for program in (programs.server(), programs.cli()):
            segments = readelf("--segments", program)
            self.assertIn("GNU_RELRO", segments)
            self.assertRegex(readelf("--dynamic", program), r"FLAGS_1.*\bNOW\b")
            stack = re.search(r"GNU_STACK.* (R[W ][E ]) ", segments)
            self.assertEqual(stack.group(1), "RW ")
            self.assertNotRegex(segments, r"LOAD.* RWE ")

    def test_stacks_and_copies_are_checked(self):
        for program in (programs.server(), programs.cli()):
            needed = readelf("--dyn-syms", program)
            self.assertIn("__stack_chk_fail", needed)
            self.assertRegex(needed, r"__mem(cpy|move|set)_chk")
            self.assertIn("__glibcxx_assert_fail", needed)


if __name__ == "__main__":
    programs.main()
