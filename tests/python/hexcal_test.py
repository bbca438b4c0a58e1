"""The Python module against what the commands and the paper say.

Usage: hexcal_test.py SOURCE PROGRAM, with PYTHONPATH set to the build's module.
"""
import ast
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import hexcal
import numpy as np

SOURCE, PROGRAM = (pathlib.Path(path) for path in sys.argv[1:3])
SAMPLE = SOURCE / "samples" / "small_lab"


def run(*arguments):
    subprocess.run([PROGRAM, *arguments], check=True, stdout=subprocess.DEVNULL)


class Kinematics(unittest.TestCase):
    def setUp(self):
        self.machine = hexcal.read_hexapod(SAMPLE / "hexapod.yaml")

    def test_forward_undoes_inverse(self):
        poses = np.random.default_rng(1).uniform(-10, 10, (50, 6))
        np.testing.assert_allclose(self.machine.forward(self.machine.inverse(poses)), poses, atol=1e-9)

    def test_a_leg_is_as_long_as_its_joints_are_apart(self):
        home = self.machine.B_from_UG.copy()
        home[2, 3] -= self.machine.gd_mm + self.machine.P_from_LG[2, 3]
        platform = self.machine.platform_joints_mm + home[:3, 3]
        lengths = np.linalg.norm(platform - self.machine.base_joints_mm, axis=1)
        np.testing.assert_allclose(self.machine.inverse(np.zeros(6))[0], lengths, atol=1e-9)

    def test_a_machine_made_of_arrays_is_the_one_read(self):
        read = self.machine
        made = hexcal.Machine(read.base_joints_mm, read.platform_joints_mm, B_from_UG=read.B_from_UG,
                              P_from_LG=read.P_from_LG, gd_mm=read.gd_mm, min_mm=380, max_mm=580)
        pose = [[5, -3, 2, 2, -1, 3]]
        np.testing.assert_allclose(made.inverse(pose), read.inverse(pose), atol=1e-9)

    def test_what_cannot_be_reached_is_nan_and_said(self):
        self.assertRegex(self.machine.verdicts([[0, 0, 400, 0, 0, 0]])[0], "^too_(long|short): leg")
        self.assertTrue(np.isnan(self.machine.forward([[1, 1, 1, 1, 1, 1.0]])).all())

    def test_wrong_input_is_refused_with_words(self):
        with self.assertRaisesRegex(hexcal.InputError, "nothere.yaml"):
            hexcal.read_hexapod("nothere.yaml")
        for wrong, found in ((np.zeros((3, 5)), r"shape \(3, 5\)"), (np.zeros(5), r"shape \(5\)"), ("home", "str"),
                             (np.zeros((2, 6, 6)), r"shape \(2, 6, 6\)"), (None, "NoneType"), ([[1], [2, 3]], "list")):
            with self.assertRaisesRegex(hexcal.InputError, f"^found .*{found}.*, wanted numbers of shape \\(N, 6\\)$"):
                self.machine.inverse(wrong)
        with self.assertRaisesRegex(hexcal.InputError, r"wanted numbers of shape \(6, 3\)"):
            hexcal.Machine(np.zeros((5, 3)), self.machine.platform_joints_mm, B_from_UG=np.eye(4), P_from_LG=np.eye(4),
                           gd_mm=50, min_mm=380, max_mm=580)
        with self.assertRaisesRegex(ValueError, "B_from_UG"):
            hexcal.Machine(self.machine.base_joints_mm, self.machine.platform_joints_mm, B_from_UG=2 * np.eye(4),
                           P_from_LG=np.eye(4), gd_mm=50, min_mm=380, max_mm=580)


class Evaluation(unittest.TestCase):
    def test_eq_7_of_the_papers_table_2(self):
        self.assertAlmostEqual(hexcal.range_magnitude([26.54, 16.67, 13.49]), 19.70, delta=0.005)
        self.assertAlmostEqual(hexcal.range_magnitude([20.25, 18.44, 14.01]), 17.76, delta=0.005)
        self.assertAlmostEqual(hexcal.improvement_percent(19.70, 17.76), 9.8, delta=0.1)

    def test_errors_of_arrays(self):
        targets = np.zeros((3, 6))
        poses = np.array([[1, 0, 0, 0, 0, 0], [3, 0, 0, 0, 0, 2], [np.nan] * 6])
        errors = hexcal.errors(targets, poses)
        self.assertEqual(errors.poses, 2)
        np.testing.assert_allclose(errors.range, [2, 0, 0, 0, 0, 2], atol=1e-12)
        np.testing.assert_allclose(errors.mean, [2, 0, 0, 0, 0, 1], atol=1e-12)
        self.assertAlmostEqual(errors.position_magnitude_mm, 2 / np.sqrt(3))
        self.assertAlmostEqual(errors.orientation_max_deg, 2)
        with self.assertRaisesRegex(hexcal.InputError, "3 targets and 2 poses"):
            hexcal.errors(targets, poses[:2])


class Calibration(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.work = pathlib.Path(cls.folder.name)
        cls.lab = cls.work / "lab"
        run("simulate", "-o", cls.lab, "--poses", "14", "--seed", "5", "--no-images",
            "--pose-noise-um", "1", "--pose-noise-mdeg", "0.5")
        cls.machine = hexcal.read_hexapod(cls.lab / "hexapod.yaml")
        cls.observations = hexcal.Observations.read(cls.machine, cls.lab / "results" / "poses.csv",
                                                    cls.lab / "targets.csv", cls.lab / "legs.csv")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def reached(self, commands):
        """Where the hidden machine stands at commands."""
        table = self.work / "commands.csv"
        rows = (",".join([name, *map(repr, row)]) for name, row in zip(self.observations.ids, commands.readings.tolist()))
        table.write_text("\n".join(["pose,q1,q2,q3,q4,q5,q6", *rows]) + "\n")
        run("simulate", "-o", self.work / "after", "--from", self.lab, "--targets", self.lab / "targets.csv",
            "--commands", table, "--no-images")
        truth = hexcal.read_poses(self.work / "after" / "truth" / "poses.csv")
        return np.array([truth.poses[truth.ids.index(name)] for name in self.observations.ids])

    def test_identified_commands_reach_the_targets(self):
        identified = hexcal.identify(self.machine, self.observations)
        self.assertLess(abs(identified.sigma0 - 1), 0.5)
        self.assertEqual(len(identified.parameters), 48)
        commands = identified.correct(self.observations.targets)
        self.assertEqual(set(commands.status), {"ok"})
        errors = hexcal.errors(self.observations.targets, self.reached(commands))
        self.assertLess(errors.position_rms_mm, 0.02)
        self.assertLess(errors.orientation_rms_deg, 0.01)
        residuals = identified.model.forward(self.observations.readings) - self.observations.measured
        self.assertLess(np.abs(residuals).max(), 0.02)

    def test_compensation_sets_the_papers_options_beside_the_geometry(self):
        result = hexcal.compensate(self.machine, self.observations)
        self.assertEqual(result.chosen, "kinematic")
        by_name = {method["name"]: method["errors"] for method in result.methods}
        for option in ("option1", "option2", "option3"):
            self.assertGreater(by_name[option].position_rms_mm, 20 * by_name["kinematic"].position_rms_mm)
        self.assertEqual(hexcal.compensate(self.machine, self.observations, method="option3").model.method, "option3")

    def test_the_command_writes_the_same_model(self):
        run("compensate", self.lab)
        written = hexcal.read_model(self.lab / "results" / "model.yaml")
        ours = hexcal.compensate(self.machine, self.observations).model
        np.testing.assert_allclose(ours.machine.base_joints_mm, written.machine.base_joints_mm, atol=1e-6)
        ours.save(self.work / "model.yaml")
        home = np.zeros((1, 6))
        np.testing.assert_array_equal(hexcal.read_model(self.work / "model.yaml").inverse(home), ours.inverse(home))

    def test_observations_from_arrays(self):
        read = self.observations
        covariances = np.tile(np.diag([1e-6] * 3 + [2.5e-7] * 3), (len(read), 1, 1))
        made = hexcal.Observations(read.measured, read.readings, covariances=covariances, targets=read.targets, ids=read.ids)
        self.assertEqual(made.ids, read.ids)
        errors = hexcal.errors(read.targets, self.reached(hexcal.identify(self.machine, made).correct(read.targets)))
        self.assertLess(errors.position_rms_mm, 0.02)
        with self.assertRaisesRegex(hexcal.InputError, "readings: found"):
            hexcal.Observations(read.measured, read.readings[:-1])
        with self.assertRaisesRegex(hexcal.InputError, "covariances"):
            hexcal.Observations(read.measured, read.readings, covariances=np.zeros((2, 6, 6)))


class Measuring(unittest.TestCase):
    def test_a_campaign_as_the_command_measures_it(self):
        with tempfile.TemporaryDirectory() as folder:
            observations = pathlib.Path(folder) / "observations.txt"
            run("detect", SAMPLE / "poses", "--camera", SAMPLE / "camera.yaml", "-o", observations)
            measured = hexcal.measure(SAMPLE, observations)
        truth = hexcal.read_poses(SAMPLE / "truth" / "poses.csv")
        self.assertEqual(sorted(measured.ids), sorted(truth.ids))
        self.assertEqual(set(measured.status), {"ok"})
        wanted = np.array([truth.poses[truth.ids.index(name)] for name in measured.ids])
        self.assertLess(np.abs(measured.poses - wanted).max(), 0.005)
        self.assertEqual(measured.covariances.shape, (9, 6, 6))
        moved = np.array(measured.ids) != "home"
        whitened = (measured.poses - wanted)[moved] / measured.sigmas[moved]
        self.assertLess(np.sqrt((whitened**2).mean()), 2)


    def test_cameras_told_apart_by_folder_and_cameras_that_suit_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            lab = pathlib.Path(folder) / "lab"
            shutil.copytree(SAMPLE, lab, ignore=shutil.ignore_patterns("p00[2-9]", "results"))
            camera = (lab / "camera.yaml").read_text()
            # Not the truth of these photographs, but another camera: where it is not chosen the poses are others.
            (lab / "right.yaml").write_text(camera.replace("cx_px: 751.5", "cx_px: 756.5"))
            text = (lab / "campaign.yaml").read_text()
            (lab / "campaign.yaml").write_text(text.replace(
                "camera: camera.yaml",
                "camera:\n  - {file: camera.yaml, folder: left}\n  - {file: right.yaml, folder: right}"))
            for pose in (lab / "poses").iterdir():
                photographs = sorted(pose.iterdir())
                for camera_folder, files in (("left", photographs[:-1]), ("right", photographs[-1:])):
                    (pose / camera_folder).mkdir()
                    for file in files:
                        file.rename(pose / camera_folder / file.name)
            subprocess.run([PROGRAM, "measure", lab], stdout=subprocess.DEVNULL)
            written = hexcal.read_poses(lab / "results" / "poses.csv")
            shutil.move(lab / "results" / "observations.txt", lab)
            shutil.rmtree(lab / "results")
            for observations in (None, lab / "observations.txt"):
                measured = hexcal.measure(lab, observations, cache=False)
                self.assertEqual(measured.ids, written.ids)
                np.testing.assert_allclose(measured.poses, written.poses, atol=1e-6)
            for file in ("camera.yaml", "right.yaml"):
                (lab / file).write_text(camera.replace("[1504, 1000]", "[1500, 1000]"))
            for observations in (None, lab / "observations.txt"):
                with self.assertRaisesRegex(hexcal.InputError, "suits a camera file"):
                    hexcal.measure(lab, observations)
            self.assertFalse(list((lab / "results").glob("*.csv")))


class Stubs(unittest.TestCase):
    def test_stubs_name_what_the_module_has(self):
        stub = ast.parse((SOURCE / "tools" / "python" / "hexcal" / "__init__.pyi").read_text())
        names = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        names.pop("MethodResult")  # a dict
        self.assertEqual(set(names) | {"__version__"}, set(hexcal.__all__))
        for name, node in names.items():
            if isinstance(node, ast.ClassDef) and name != "InputError":
                members = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
                there = {member for member in dir(getattr(hexcal, name)) if not member.startswith("_")}
                self.assertEqual(members - {"__init__", "__len__"}, there, name)

    def test_everything_has_a_docstring(self):
        for name in set(hexcal.__all__) - {"__version__", "InputError"}:
            self.assertTrue(getattr(hexcal, name).__doc__, name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
