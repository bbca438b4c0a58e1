#!/usr/bin/env python3
"""mrcal's calibration of the points that camera_accuracy used.

Reads a folder that camera_accuracy wrote: points.csv (photograph, x_mm, y_mm, z_mm, x_px, y_px), views.csv (pose of the
sheet in the camera per photograph to start from: rotation vector, translation), camera.csv (width, height, f, cx, cy) and
rays.csv (x_px, y_px, ray x, y, z by the true camera). Prints per lens model the rms difference of projection to the truth,
best rotation taken out. Needs Debian's python3-mrcal.
"""
import sys

import mrcal
import numpy as np
import scipy.optimize


def difference_rms_px(lensmodel, intrinsics, rays):
    def residual(turn):
        rotated = mrcal.rotate_point_r(turn, rays[:, 2:5])
        return (mrcal.project(rotated, lensmodel, intrinsics) - rays[:, :2]).ravel()

    turn = scipy.optimize.least_squares(residual, np.zeros(3), x_scale=1e-4).x
    return np.sqrt(np.mean(np.sum(residual(turn).reshape(-1, 2) ** 2, axis=1)))


def main():
    folder = sys.argv[1]
    points = np.loadtxt(folder + "/points.csv", delimiter=",")
    views = np.loadtxt(folder + "/views.csv", delimiter=",")
    width, height, f, cx, cy = np.loadtxt(folder + "/camera.csv", delimiter=",")
    rays = np.loadtxt(folder + "/rays.csv", delimiter=",")
    fixed, index = np.unique(points[:, 1:4], axis=0, return_inverse=True)
    order = np.lexsort((points[:, 0], index))
    observations = np.column_stack((points[order, 4:6], np.ones(len(points))))
    indices = np.column_stack((index[order], np.zeros(len(points)), points[order, 0])).astype(np.int32)
    fov_deg = int(np.ceil(np.degrees(2 * np.arctan(0.55 * width / f)))) + 2
    models = [
        "LENSMODEL_OPENCV4",
        "LENSMODEL_OPENCV5",
        "LENSMODEL_OPENCV8",
        "LENSMODEL_OPENCV12",
        "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=12_Ny=8_fov_x_deg=%d" % fov_deg,
    ]
    best = None
    for lensmodel in models:
        splined = "SPLINED" in lensmodel
        intrinsics = np.zeros((1, mrcal.lensmodel_num_params(lensmodel)))
        intrinsics[0, :4] = f, f, cx, cy
        problem = dict(
            intrinsics=intrinsics,
            extrinsics_rt_fromref=views.copy(),
            frames_rt_toref=np.zeros((0, 6)),
            points=fixed.copy(),
            observations_board=np.zeros((0, 1, 1, 3)),
            indices_frame_camintrinsics_camextrinsics=np.zeros((0, 3), dtype=np.int32),
            observations_point=observations.copy(),
            indices_point_camintrinsics_camextrinsics=indices,
            lensmodel=lensmodel,
            imagersizes=np.array([[width, height]], dtype=np.int32),
            Npoints_fixed=len(fixed),
            point_min_range=1.0,
            point_max_range=1e5,
            do_optimize_intrinsics_core=not splined,
            do_optimize_intrinsics_distortions=True,
            do_optimize_extrinsics=True,
            do_optimize_frames=False,
            do_optimize_calobject_warp=False,
            do_apply_regularization=True,
            do_apply_outlier_rejection=True,
            verbose=False,
        )
        mrcal.optimize(**problem)
        rms = difference_rms_px(lensmodel, problem["intrinsics"][0], rays)
        if best is None or rms < best:
            best = rms
        print(lensmodel, "%.4f" % rms, file=sys.stderr)
    print("%.6f" % best)


if __name__ == "__main__":
    main()
