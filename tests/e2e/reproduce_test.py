"""lpdeform reproduce as users run it."""

import json
import math
import os
import signal
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

from programs import PATIENCE, cli, main, read_bytes, read_text, run


class Reproduce(unittest.TestCase):
    """On shapes of a quarter of the size, for which not every claim must hold."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = os.path.join(cls.temporary.name, "made", "page")
        mesh, handles = (os.path.join(cls.temporary.name, name) for name in ("my bar.off", "bar.json"))
        assert run("shape", "bar", "--out", mesh, "--handles", handles).returncode == 0
        cls.done = run("reproduce", "--out", cls.folder, "--size", 0.25, "--threads", 1, "--mesh", mesh, "--handles", handles)
        assert cls.done.returncode == 0, cls.done.stderr
        cls.page = xml.etree.ElementTree.parse(os.path.join(cls.folder, "index.html")).getroot()
        cls.verdicts = json.loads(read_text(os.path.join(cls.folder, "reproduce.json")))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def elements(self, name, within=None):
        return list((self.page if within is None else within).iter("{http://www.w3.org/1999/xhtml}" + name))

    def sections(self):
        return {section.get("id"): section for section in self.elements("section")}

    def test_every_figure_of_the_paper_and_the_other_mesh_is_there(self):
        wanted = ["table_1", *(f"figure_{k}" for k in range(1, 10)), "section_3_2", "section_5", "appendix", "mesh_my_bar"]
        self.assertEqual([figure["id"] for figure in self.verdicts["figures"]], wanted)
        self.assertEqual(list(self.sections()), wanted)

    def test_every_figure_has_claims_numbers_and_verdicts_and_the_page_says_the_same(self):
        for figure in self.verdicts["figures"]:
            text = "".join(self.sections()[figure["id"]].itertext())
            self.assertGreaterEqual(len(figure["claims"]), 1)
            for claim in figure["claims"]:
                self.assertIn(claim["text"], text)
                self.assertIn(claim["measured"], text)
                self.assertIn("holds here" if claim["holds"] else "does not hold here", text)
                self.assertTrue(claim["numbers"])
                self.assertTrue(all(math.isfinite(number) for number in claim["numbers"].values()), claim)
        self.assertEqual(self.verdicts["claims_that_hold"],
                         sum(claim["holds"] for figure in self.verdicts["figures"] for claim in figure["claims"]))

    def test_the_table_says_of_other_sizes_and_other_meshes_that_they_are_not_the_papers(self):
        text = "".join(self.sections()["table_1"].itertext())
        self.assertNotIn("All shapes are generated", text)
        self.assertIn("were added by --mesh", text)
        self.assertNotIn("paper's own numbers of vertices and faces", text)
        self.assertIn("0.25 times as many cells", text)
        self.assertNotIn("mean of all entries", text)
        self.assertIn("cannot be compared with these", text)

    def test_a_method_has_one_colour_in_all_plots_of_figure_1(self):
        styles = {}
        plots = self.elements("div", self.sections()["figure_1"])[-1]
        for plot in plots:
            lines = [line.get("class") for line in plot if line.get("class", "").startswith("line ")]
            names = [text.text for text in plot if text.text in ("conic", "line_search", "quasi_newton")]
            self.assertEqual(len(lines), 2 * len(names))  # each in the plot and in the legend
            for name, line, entry in zip(names, lines, lines[len(names):]):
                self.assertEqual(line, entry)
                styles.setdefault(name, set()).add(line)
        self.assertEqual(set(styles), {"conic", "line_search", "quasi_newton"})
        self.assertEqual(len(set.union(*styles.values())), 3, styles)

    def test_verdicts_follow_from_their_numbers(self):
        claims = {figure["id"]: figure["claims"] for figure in self.verdicts["figures"]}
        for figure in ("figure_3", "figure_4"):
            shares = list(claims[figure][0]["numbers"].values())
            self.assertEqual(len(shares), 4)
            self.assertEqual(claims[figure][0]["holds"], all(a > b for a, b in zip(shares, shares[1:])))
        for figure in ("figure_5", "figure_7"):
            one, two = claims[figure][0]["numbers"].values()
            self.assertGreaterEqual(min(one, two), 1)
            self.assertEqual(claims[figure][0]["holds"], one < two)
        one, two = claims["figure_6"][0]["numbers"].values()
        self.assertEqual(claims["figure_6"][0]["holds"], one < two)
        starts, proof = claims["section_3_2"]
        self.assertEqual((len(starts["numbers"]), len(proof["numbers"])), (13, 13))
        self.assertTrue(starts["holds"] and max(starts["numbers"].values()) <= 1e-6, starts)
        self.assertTrue(proof["holds"] and max(proof["numbers"].values()) <= 1e-3, proof)
        for claim, cases in zip(claims["section_5"], (15, 5)):
            self.assertEqual(len(claim["numbers"]), cases)
            self.assertEqual(claim["holds"], max(claim["numbers"].values()) <= 0.75)
        sooner = claims["figure_1"][3]
        self.assertEqual(len(sooner["numbers"]), 9)
        self.assertEqual(sooner["holds"], sooner["numbers"]["shapes_where_p6_is_sooner"] == 4)
        sparsity = claims["appendix"][1]
        self.assertEqual(sparsity["numbers"]["shapes"], 6)
        self.assertEqual(sparsity["holds"], sparsity["numbers"]["sparser_shapes"] == 6)

    def test_all_pictures_are_there_and_nothing_else_and_none_comes_from_elsewhere(self):
        shown = [picture.get("src") for picture in self.elements("img")]
        self.assertEqual(sorted(set(shown) | {"index.html", "reproduce.json"}), sorted(os.listdir(self.folder)))
        for name in shown:
            self.assertEqual(read_bytes(os.path.join(self.folder, name))[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(self.elements("script") + self.elements("link"), [])
        for link in self.elements("a"):
            self.assertTrue(link.get("href").startswith("#") or link.get("href") == "reproduce.json", link.get("href"))

    def test_table_1_has_a_row_here_and_a_row_of_the_paper(self):
        rows = [[cell.text for cell in row] for row in self.elements("tr", self.sections()["table_1"])]
        self.assertEqual([row[0] for row in rows[1:]],
                         ["sheet, here", "Sheet, paper", "bar, here", "Bar, paper", "block, here", "Block, paper",
                          "creature, here", "Dinopet, paper", "arm, here", "Rocker arm, paper", "my_bar, here"])
        self.assertEqual({len(row) for row in rows}, {11})

    def test_plots_stand_inside_the_page(self):
        plots = [section for section in ("figure_1", "figure_2")
                 for _ in self.sections()[section].iter("{http://www.w3.org/2000/svg}svg")]
        self.assertEqual(plots, ["figure_1"] * 3 + ["figure_2"] * 2)

    def test_its_own_folder_is_written_again_without_the_pictures_of_other_meshes(self):
        before = sorted(os.listdir(self.folder))
        done = run("reproduce", "--out", self.folder, "--size", 0.25, "--threads", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), [name for name in before if not name.startswith("my_bar")])
        self.assertNotIn("my_bar", read_text(os.path.join(self.folder, "index.html")))

    def test_no_picture_of_an_earlier_page_stays(self):
        folder = os.path.join(self.temporary.name, "earlier")
        os.mkdir(folder)
        for name in ("old.png", "mine.png"):
            with open(os.path.join(folder, name), "w") as file:
                file.write("picture")
        with open(os.path.join(folder, "reproduce.json"), "w") as file:
            json.dump({"made_by": "lpdeform reproduce", "figures": [{"pictures": ["old.png", "bar_p1.png"]}]}, file)
        done = run("reproduce", "--out", folder, "--size", 0.25, "--threads", 1)
        self.assertEqual(done.returncode, 0, done.stderr)
        left = set(os.listdir(folder))
        self.assertNotIn("old.png", left)
        self.assertTrue({"mine.png", "bar_p1.png"} <= left)

    def test_a_folder_of_others_is_refused_and_left_as_it_is(self):
        taken = os.path.join(self.temporary.name, "taken")
        os.mkdir(taken)
        with open(os.path.join(taken, "index.html"), "w") as file:
            file.write("mine")
        done = run("reproduce", "--out", taken, "--size", 0.25)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("--force", done.stderr)
        self.assertEqual(os.listdir(taken), ["index.html"])
        self.assertEqual(read_text(os.path.join(taken, "index.html")), "mine")

    def test_bad_input_is_one_line_that_names_it(self):
        out = os.path.join(self.temporary.name, "bad")
        mesh = os.path.join(self.temporary.name, "my bar.off")
        for arguments, named in [([], "--out"), (["--out", out, "--size", "0"], "0.25"), (["--out", out, "--mesh", mesh], "--handles"),
                                 (["--out", out, "--mesh", "/nowhere.off", "--handles", mesh], "/nowhere.off"),
                                 (["--out", out, "--mesh", mesh, "--handles", "/nowhere.json"], "/nowhere.json"),
                                 (["--out", "/proc/nowhere"], "/proc/nowhere"), (["--out", mesh], "my bar.off")]:
            with self.subTest(arguments=arguments):
                done = run("reproduce", *arguments)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(named, done.stderr)
        self.assertFalse(os.path.exists(out))

    def test_handles_that_the_papers_methods_do_not_know_are_refused(self):
        mesh, soft, out = (os.path.join(self.temporary.name, name) for name in ("my bar.off", "soft.json", "soft"))
        with open(soft, "w") as file:
            file.write('{"handles": [{"name": "tip", "vertices": [1], "soft": 1}]}')
        done = run("reproduce", "--out", out, "--mesh", mesh, "--handles", soft)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn('handle "tip"', done.stderr)
        self.assertFalse(os.path.exists(out))

    def test_ctrl_c_ends_it_and_writes_nothing(self):
        out, pipe = (os.path.join(self.temporary.name, name) for name in ("stopped", "bar.fifo"))
        os.mkfifo(pipe)
        process = subprocess.Popen([cli(), "reproduce", "--out", out, "--mesh", os.path.join(self.temporary.name, "my bar.off"),
                                    "--handles", pipe], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        with open(pipe, "w") as handles:  # opens when the program reads its handles
            process.send_signal(signal.SIGINT)
            handles.write(read_text(os.path.join(self.temporary.name, "bar.json")))
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(os.listdir(out) if os.path.exists(out) else [], [])


if __name__ == "__main__":
    main()
