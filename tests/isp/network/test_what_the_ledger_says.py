"""The ledger states the limits of a model: filters of another sensor, light beyond its training."""

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core import ledger
from isethdr_core.errors import UnitError


def notes(path, captures):
    """Return the isp's ledger as one dictionary: key to value for error terms, and key to reason
    for what it leaves out.
    """
    rows = ledger.Ledger()
    with ledger.stage(rows, "isp network"):
        hdr.build("isp", "network", model=str(path))(captures)
    said = {term.source.key: term.value for term in rows[0].errors}
    return said | {note.key: note.why for note in rows[0].left_out}


@pytest.fixture
def trained_for(models, taken, tmp_path):
    """Return a function that runs a model made for given filter curves and returns its ledger."""
    captures, matrix = taken()

    def make(curves, wavelength_nm, **more):
        stated = {name: curve.tolist() for name, curve in zip("RGB", curves, strict=True)}
        contract = {
            **models.CONTRACT,
            "quantum_efficiency": stated,
            "wavelength_nm": wavelength_nm.tolist(),
            **more,
        }
        path = models.bilinear_model(tmp_path / "model.onnx", matrix, contract=contract)
        return notes(path, captures)

    return make


def test_the_same_filters_differ_by_nothing(trained_for, bench):
    nm = bench.WAVELENGTH
    assert trained_for(bench.QE, nm)["filters"] < 1e-12
    # a factor on all curves acts like another exposure, which the unit cancels
    assert trained_for(0.3 * bench.QE, nm)["filters"] < 1e-12


def test_other_filters_are_stated_by_how_far_they_differ(trained_for, bench):
    nm = bench.WAVELENGTH
    redder = bench.QE * np.array([1.2, 1.0, 1.0])[:, None]
    # red has a sixth fewer electrons than in training
    assert trained_for(redder, nm)["filters"] == pytest.approx(1 / 6, rel=1e-6)
    with pytest.raises(UnitError, match="filters are not those that the model is for.* isp=merge"):
        trained_for(bench.QE[::-1], nm)


def test_light_beyond_the_training_is_stated(trained_for, bench):
    said = trained_for(bench.QE, bench.WAVELENGTH, range_e=[1.0, 1500.0])
    # samples are uniform from 5 to 3000 e, so half are above 1500 e
    assert "are above 1500 e" in said["range"]
    assert 45 < float(said["range"].partition("%")[0]) < 55
    assert "range" not in trained_for(bench.QE, bench.WAVELENGTH, range_e=[1.0, 1e5])
