"""Blocks of work on several threads: the result equals that of `map`, each item is computed once,
and linear algebra uses one thread meanwhile.
"""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from isethdr_optics.imaging.threads import cpus, threads
from threadpoolctl import threadpool_info


def test_gives_what_map_gives_each_item_once(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    done = []
    who = set()
    all_began = threading.Barrier(3, timeout=600)

    def double(number):
        if number < 3:
            all_began.wait()  # only three threads at work together get past it
        done.append(number)
        who.add(threading.get_ident())
        return 2 * number

    with threads() as apply:
        assert apply(double, range(50)) == [2 * n for n in range(50)]
        assert apply(double, []) == []
    assert sorted(done) == list(range(50))
    assert len(who) == 3


def test_two_callers_share_the_threads(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with threads() as apply, ThreadPoolExecutor(2) as two:
        both = list(two.map(lambda k: apply(lambda n: k * n, range(200)), (1, 10)))
    assert both == [list(range(200)), list(range(0, 2000, 10))]


def test_an_error_of_any_item_is_raised_and_ends_the_work(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    done = []
    failed = threading.Event()

    def fail(number):
        if number == 0:
            failed.set()
            raise IndexError("of the work itself")
        failed.wait(600)
        time.sleep(0.002)
        done.append(number)

    with pytest.raises(IndexError, match="of the work itself"), threads() as apply:
        apply(fail, range(1000))
    assert len(done) < 500  # two seconds of work were left when it happened


def test_linear_algebra_has_one_thread_meanwhile():
    def counts():
        return [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]

    before = counts()
    assert before  # NumPy's own at least
    with threads():
        assert set(counts()) == {1}
    assert counts() == before


@pytest.mark.parametrize("text, count", [("3", 3), ("2,1", 2), ("0", None), ("", None)])
def test_the_number_of_threads_is_the_outermost_that_openmp_reads(monkeypatch, text, count):
    monkeypatch.setattr("os.sched_getaffinity", lambda _process: set(range(5)), raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("OMP_NUM_THREADS", text)
    assert cpus() == (count or 5), "without a number, the processors that the process may use"
