"""The compared scenes: volumes by their usual file names, each with a transfer function in
functions/ or datasets/."""
import os
from collections import namedtuple

import generated

HERE = os.path.dirname(os.path.abspath(__file__))
INCLUDED = os.path.join(HERE, "..", "..", "datasets")

# kind: "sparse" (most of the box is empty or hidden by opaque parts) or "dense".
Scene = namedtuple("Scene", "name file function shading kind shows")

SCENES = [
    Scene("tooth", "tooth.nhdr", "tooth", True, "dense", "dentine and enamel, translucent"),
    Scene("enamel", "tooth.nhdr", "enamel", True, "sparse", "only the enamel, opaque"),
    Scene("stent", "stent.nrrd", "stent", True, "sparse", "stent, bones and vessels"),
    Scene("cloud", "wdas_cloud_sixteenth.vdb", "cloud", False, "sparse", "a cloud"),
    Scene("aneurism", "aneurism_256x256x256_uint8.nhdr", "aneurism", True, "sparse", "vessels"),
    Scene("engine-metal", "engine_256x256x128_uint8.nhdr", "engine-metal", True, "sparse",
          "only the dense metal parts"),
    Scene("brain", "ch2better.nii.gz", "brain", True, "sparse", "the surface of a brain"),
    Scene("lucy", "lucy-1024.vol", "lucy", True, "sparse", "a statue, solid"),
    Scene("smoke", "smoke.vdb", "smoke", False, "sparse", "a plume of smoke"),
    Scene("engine", "engine_256x256x128_uint8.nhdr", "engine", True, "dense",
          "all of it, translucent"),
    Scene("bonsai", "bonsai.nii.gz", "bonsai", True, "dense", "tree and soil, translucent"),
    Scene("head", "cthead_256x256x99_uint16.nhdr", "cthead", True, "dense", "skin and bone"),
    Scene("chest", "lidc-idri-0314_512x512x275_int16.nhdr", "chest", True, "dense",
          "lungs, flesh and bone, translucent"),
    Scene("brain-translucent", "ch2better.nii.gz", "brain-translucent", True, "dense",
          "all of a brain, opacity 0 to 0.4 from value 60 to 255"),
    Scene("marschner-lobb", generated.MARSCHNER_LOBB, "marschner-lobb", True, "dense",
          "the signal of Marschner and Lobb"),
    Scene("porous", generated.POROUS, "porous", True, "sparse",
          "a scan of a porous solid, larger than the screen"),
    Scene("porous-flat", generated.POROUS, "porous", False, "sparse", "the same without light"),
]


def function_path(scene):
    own = os.path.join(HERE, "functions", scene.function + ".tf")
    return own if os.path.exists(own) else os.path.join(INCLUDED, scene.function + ".tf")


def find(scene, folders, work, triptych):
    """Returns the path of the scene's volume, or None. A generated volume is made in the folder
    `work`. Others are searched in `folders` and their subfolders, in order."""
    made = generated.make(scene.file, work, triptych)
    if made:
        return made
    for folder in folders:
        for root, below, files in os.walk(folder):
            below.sort()
            if scene.file in files:
                return os.path.join(root, scene.file)
    return None
