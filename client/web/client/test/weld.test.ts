import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { reportFromWire } from "../src/fromwire.js";
import { MeshReportSchema } from "../src/gen/lpdeform/v1/report_pb.js";
import { Packer } from "../src/packer.js";
import { weldToWire } from "../src/towire.js";

test("a weld by position has the server's tolerance, or its own", () => {
  expect(weldToWire("byPosition", new Packer()).by).toMatchObject({ case: "position", value: { tolerance: 0 } });
  const own = weldToWire({ tolerance: 1e-4 }, new Packer());
  expect(own.by).toMatchObject({ case: "position", value: { tolerance: 1e-4 } });
  expect(weldToWire([0, 0, 1], new Packer()).by.case).toBe("groups");
});

test("what is to be known of a mesh stands in its report", () => {
  const defects = [{ kind: "split_border_vertices", count: 12, first: [3, 17] }];
  expect(reportFromWire(create(MeshReportSchema, { defects })).notices).toEqual([
    "The mesh comes apart where it is split: 12 vertices at its borders lie in the same place as others (vertices 3, 17, ...). " +
      "Weld it by position to hold it together there.",
  ]);
  expect(reportFromWire(create(MeshReportSchema)).notices).toEqual([]);
});
