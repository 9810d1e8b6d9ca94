"""Two floods that gRPC 1.51 does not bound and newer gRPC does, on the server's own port (deploy/newest-grpc)."""

import floods_test
import programs

MIB = floods_test.MIB


class TheServerAlone(floods_test.Flooded):
    def test_of_calls_that_are_taken_back_at_once_few_begin(self):
        before = self.serve()
        tried = sum(self.attack().reset(20_000) for _ in range(5))
        self.assertEqual(tried, 100_000)
        self.assertTrue(self.serves())
        self.assertLess(self.calls("call_started", "ListSessions"), tried / 10)
        self.assertLess(self.memory(which="VmHWM") - before, 96 * MIB)
        self.assertIn('"serving"', self.admin("/livez"))

    def test_headers_without_end_are_thrown_away(self):
        before = self.serve()
        self.assertGreaterEqual(self.attack(answers=False).endless_headers(256 * MIB), 256 * MIB)
        self.assertTrue(self.serves())
        self.assertLess(self.memory(which="VmHWM") - before, 192 * MIB)


if __name__ == "__main__":
    programs.main()
