"""Pictures of lpdeform deform: --size, --camera and --red, by which several can be compared."""

import json
import os
import struct
import zlib

from programs import OnShapes, main, read_bytes, read_off, read_off_faces, read_ply, run

SIZE = ("--size", "240,180")


class Picture:
    """A PNG picture of three bytes a pixel, as lpdeform writes them."""

    def __init__(self, path):
        data = read_bytes(path)
        assert data[:8] == b"\x89PNG\r\n\x1a\n"
        at, packed = 8, b""
        while at < len(data):
            length, kind = struct.unpack(">I4s", data[at:at + 8])
            body = data[at + 8:at + 8 + length]
            if kind == b"IHDR":
                self.width, self.height, depth, colours = struct.unpack(">IIBB", body[:10])
                assert (depth, colours) == (8, 2)
            if kind == b"IDAT":
                packed += body
            at += 12 + length
        self.rows = self.unfiltered(zlib.decompress(packed))

    def unfiltered(self, data):
        rows, above, step = [], bytes(3 * self.width), 3 * self.width + 1
        for y in range(self.height):
            kind, line, row = data[y * step], data[y * step + 1:(y + 1) * step], bytearray()
            for k, value in enumerate(line):
                left, corner = (row[k - 3], above[k - 3]) if k >= 3 else (0, 0)
                up = above[k]
                nearest = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
                row.append((value + (0, left, up, (left + up) // 2, nearest)[kind]) % 256)
            rows.append(bytes(row))
            above = row
        return rows

    def pixel(self, x, y):
        return tuple(self.rows[y][3 * x:3 * x + 3])

    def all(self):
        return [(x, y) for y in range(self.height) for x in range(self.width)]

    def drawn(self):
        """The pixels of another colour than the background, which is a grey with a little blue."""
        return {at for at in self.all() if not (self.pixel(*at)[0] == self.pixel(*at)[1] == self.pixel(*at)[2] - 3)}


class Pictures(OnShapes):
    """On a bar of which only the upper half may move."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.points = read_off(cls.at("bar.off"))
        heights = [z for _, _, z in cls.points]
        cls.top, cls.bottom = max(heights), min(heights)
        for name, shift in (("rest", 0), ("near", 1), ("far", 6)):
            file = {"handles": [{"name": "top", "vertices": [k for k, z in enumerate(heights) if z == cls.top], "translate": [0, shift, 0]}],
                    "region": [k for k, z in enumerate(heights) if z > (cls.top + cls.bottom) / 2]}
            with open(cls.at(f"{name}.json"), "w") as out:
                json.dump(file, out)

    def picture(self, name, *options, mesh="bar.off"):
        out = self.at(f"{name}.png")
        done = run("deform", self.at(mesh), "--handles", self.at(f"{name}.json"), "--out", out, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return Picture(out)

    def test_a_picture_has_the_size_that_is_asked_for(self):
        for width, height in ((240, 180), (1, 1), (31, 70)):
            picture = self.picture("near", "--size", f"{width},{height}")
            self.assertEqual((picture.width, picture.height), (width, height))
        out = self.at("usual.png")
        self.assertEqual(run("shape", "bar", "--out", out).returncode, 0)
        self.assertEqual(struct.unpack(">II", read_bytes(out)[16:24]), (1200, 900))

    def test_of_one_camera_what_has_not_moved_is_where_it_was(self):
        def moved(*options):
            near, far = (self.picture(name, *SIZE, "--red", 1, *options) for name in ("near", "far"))
            different = {at for at in near.all() if near.pixel(*at) != far.pixel(*at)}
            return near, different, near.drawn() - different

        near, different, same = moved("--camera", self.at("bar.off"))
        # z runs up: the lower half of the bar, which is held, is the lower half of what is seen.
        rows = [y for _, y in near.drawn()]
        middle = (min(rows) + max(rows)) / 2
        self.assertGreater(len(different), 200)
        self.assertEqual([at for at in different if at[1] > middle + 0.1 * near.height], [])
        self.assertGreater(len([at for at in same if at[1] > middle]), 500)
        _, different, _ = moved()
        self.assertGreater(len([at for at in different if at[1] > middle + 0.1 * near.height]), 200, "each has its own camera")

    def test_a_camera_is_that_of_a_picture_of_its_mesh_whatever_is_shown(self):
        own = self.picture("rest", *SIZE)
        self.assertEqual(self.picture("rest", *SIZE, "--camera", self.at("bar.off")).rows, own.rows)
        # The same bar, half as large: it is drawn into the camera of the whole one, and in the same one it looks smaller.
        faces = read_off_faces(self.at("bar.off"))
        text = ["OFF", f"{len(self.points)} {len(faces)} 0", *(f"{x / 2!r} {y / 2!r} {z / 2!r}" for x, y, z in self.points),
                *(f"3 {a} {b} {c}" for a, b, c in faces)]
        self.write("small.off", "\n".join(text) + "\n")
        alone = self.picture("rest", *SIZE, mesh="small.off")
        self.assertEqual(alone.drawn(), own.drawn(), "a camera of its own does not tell")
        beside = self.picture("rest", *SIZE, "--camera", self.at("bar.off"), mesh="small.off")
        self.assertLess(len(beside.drawn()), 0.5 * len(own.drawn()))

    def test_red_is_the_distortion_that_is_shown_in_full_red(self):
        ply, out = self.at("far.ply"), self.at("far.png")
        options = ("deform", self.at("bar.off"), "--handles", self.at("far.json"), *SIZE)
        self.assertEqual(run(*options, "--out", ply, "--out", out).returncode, 0)
        own = Picture(out)
        sorted_ones = sorted(vertex["distortion"] for vertex in read_ply(ply))
        percentile = next(value for k, value in enumerate(sorted_ones) if 20 * (k + 1) >= 19 * len(sorted_ones))
        self.assertEqual(self.picture("far", *SIZE, "--red", repr(percentile)).rows, own.rows)

        def share_of_red(red):
            picture = self.picture("far", *SIZE, "--red", red)
            shown = [picture.pixel(*at) for at in picture.drawn()]
            return sum(r > 1.5 * b for r, _, b in shown) / len(shown)

        shares = [share_of_red(factor * percentile) for factor in (0.1, 1, 1000)]
        self.assertEqual(shares, sorted(shares, reverse=True))
        self.assertGreater(shares[0], shares[1] + 0.05)
        self.assertLess(shares[2], 0.03, "the legend alone is red")

    def test_values_that_make_no_picture_are_refused_by_name_and_nothing_is_written(self):
        out = self.at("refused.png")
        deform = ("deform", self.at("bar.off"), "--handles", self.at("near.json"), "--out", out)
        for options, named in (
                (("--size", "0,10"), "--size: Value 0"), (("--size", "10"), "--size"), (("--size", "10,10,10"), "--size"),
                (("--size", "16385,10"), "16384"), (("--size", "a,b"), "--size: Value a"), (("--red", "0"), "--red: 0"),
                (("--red", "-1"), "--red: -1"), (("--red", "nan"), "--red: nan"), (("--red", "inf"), "--red: inf"),
                (("--camera", self.at("none.off")), "none.off"), (("--camera", self.at("bar.json")), "bar.json"),
                (("--camera", self.write("empty.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n")), "--camera")):
            self.assertIn(named, self.refused(2, *deform, *options))
        self.assertFalse(os.path.exists(out))


if __name__ == "__main__":
    main()
