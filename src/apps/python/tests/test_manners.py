"""How the module behaves among others."""

import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import deepshadow as ds


def run(code, **how):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100, **how)


def test_it_says_nothing():
    found = run("import deepshadow as ds; ds.render('bucky', size=16, backend='cpu')")
    assert (found.returncode, found.stdout, found.stderr) == (0, "", "")


def test_progress_is_told_and_may_stop():
    seen = []
    ds.render("clouds", backend="cpu", size=128, progress=lambda *told: seen.append(told))
    assert seen and all(done <= total for _, done, total in seen)

    class Enough(Exception):
        pass

    def stop(*_):
        raise Enough

    with pytest.raises(Enough):
        ds.render("clouds", backend="cpu", size=1024, progress=stop)


def test_ctrl_c_ends_it():
    code = """
import os, signal, threading, deepshadow as ds
threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    ds.render("clouds", backend="cpu", size=2048, image={"samples": 64, "tolerance": 0.0})
except KeyboardInterrupt:
    print("ended")
"""
    begun = time.monotonic()
    assert run(code).stdout == "ended\n"
    assert time.monotonic() - begun < 60


def test_other_threads_go_on():
    ticks = []
    end = threading.Event()

    def tick():
        while not end.wait(0.005):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    ds.render("clouds", backend="cpu", size=256)
    end.set()
    thread.join()
    assert len(ticks) > 5


def test_two_threads_render_at_once():
    alone = ds.render("bucky", backend="cpu", size=64).array
    found = [None] * 4

    def work(i):
        found[i] = ds.render("bucky", backend="cpu", size=64).array

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(one, alone) for one in found)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_children_of_a_fork_work():
    code = """
import os, deepshadow as ds
before = ds.render("bucky", size=32, backend="cpu").array
child = os.fork()
if child == 0:
    after = ds.render("bucky", size=32).array
    os._exit(0 if (after == before).all() else 1)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert run(code).stdout == "0\n"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_children_of_a_fork_read_and_write(tmp_path):
    # Everything that uses threads, in the parent and then in the child.
    code = """
import os, numpy as np, deepshadow as ds
def work():
    array = np.random.default_rng(1).random((40, 40, 40), dtype=np.float32)
    ds.write("a.vdb", array)
    ds.write("a.nrrd", array, compression="gzip")
    file = ds.open("a.vdb")
    assert np.array_equal(file.sparse().volume().array, array)
    assert np.array_equal(ds.read("a.nrrd").array, array)
    image = ds.render(array, size=64, backend="cpu")
    return image.png()
before = work()
child = os.fork()
if child == 0:
    os._exit(0 if work() == before else 1)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    assert run(code, cwd=tmp_path).stdout == "0\n"


def test_import_is_quick_enough_to_be_unnoticed():
    # What it imports beyond NumPy is one module.
    code = "import numpy, sys; a = set(sys.modules); import deepshadow; print(sorted(set(sys.modules) - a))"
    assert run(code).stdout == "['deepshadow', 'deepshadow._native']\n"


def test_every_public_name_is_explained():
    for name in ds.__all__:
        own = getattr(ds, name)
        assert own.__doc__, name
        for key, member in vars(own).items() if isinstance(own, type) else ():
            if not key.startswith("_"):
                assert member.__doc__, f"{name}.{key}"
