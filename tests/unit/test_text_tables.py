"""CSV and text files as instruments, MATLAB and spreadsheets write them: each reads back to the same response."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.base.errors import InputError
from identification.formats.reading import Reading
from identification.formats.spellings import spelt
from identification.sweeps.kept_responses import write_responses
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse

F = np.arange(1.0, 13.0)
H = 10 / (1j * F + 2) * np.exp(-0.1j * F)
DB, DEG, RAD = 20 * np.log10(np.abs(H)), np.degrees(np.angle(H)), np.angle(H)
SIZE = np.abs(H)


def _rows(*columns: np.ndarray, by: str = ",", end: str = "") -> str:
    return "".join(by.join(map(repr, map(float, row))) + end + "\n" for row in zip(*columns, strict=True))


CARTESIAN = _rows(F, H.real, H.imag)
POLAR = _rows(F, DB, DEG)
SEMICOLONS = _rows(F, H.real, H.imag, by=";")
KINDS = (
    "expected frequency_hz, magnitude_db, phase_deg or frequency_hz, real, imag or frequency_hz, response "
    "or time_s, input, output (or omega, magnitude, phase_rad, input_held in their place), or --columns NAME=OURS"
)
COMPLEX = [f"{z.real:.17g}{z.imag:+.17g}" for z in H]
BODE_100 = (
    'Frequency (Hz);"Trace 1: Gain: Real ";"Trace 1: Gain: Imaginary ";Trace 1: Gain: Magnitude (dB);'
    '"Trace 2: Gain: Real ";"Trace 2: Gain: Imaginary ";Trace 2: Gain: Phase (°)\n'
)
TEXTS: dict[str, tuple[str, str]] = {
    # instruments; docs/how_to/files.md says where the headers were seen
    "Bode 100": (BODE_100 + _rows(F, H.real, H.imag, DB, H.real, H.imag, DEG, by=";"), "utf-8-sig"),
    "Bode 100, traces of one part each": (
        "Frequency (Hz),Trace 1: Gain: Magnitude (dB),Trace 2: Gain: Phase (°)\n" + POLAR,
        "cp1252",
    ),
    "WaveForms": (
        "#Digilent WaveForms Network Analyzer\n#Date Time: 2019-03-01\n\n"
        "Frequency (Hz),Channel 1 Magnitude (dB),Channel 2 Magnitude (dB),Channel 2 Phase (deg)\n"
        + _rows(F, 0 * F, DB, DEG),
        "utf-8",
    ),
    "WaveForms, header in a comment": (
        "#Frequency (Hz),Channel 1 Magnitude (dB),Channel 2 Magnitude (dB),Channel 2 Phase (deg)\n"
        + _rows(F, 0 * F, DB, DEG),
        "utf-8",
    ),
    "Keysight oscilloscope": (
        "#,Frequency (Hz),Amplitude (Vpp),Gain (dB),Phase (°)\n" + _rows(F, F, 2 + 0 * F, DB, DEG),
        "cp1252",
    ),
    "Keysight network analyser": (
        f"!CSV A.01.01\n!Date: Friday, May 1, 2020\n\nBEGIN CH1_DATA\nFreq(Hz),S21(REAL),S21(IMAG)\n{CARTESIAN}END\n\n",
        "utf-8",
    ),
    "Siglent": (
        f"Model,SDS2104X\nStart,1\nPoints,12,log\nFrequency(Hz),CH1 Amplitude(dB),CH1 Phase(Deg)\n{POLAR}",
        "utf-8",
    ),
    "R&S ZNB": (
        "# Version 1.00\n#\nfreq[Hz];re:Trc1_S21;im:Trc1_S21;\n" + _rows(F, H.real, H.imag, by=";", end=";"),
        "utf-8",
    ),
    "R&S ZVA": (
        "[Hz];reTrc1_S21;imTrc1_S21;\n" + _rows(F, H.real, H.imag, by=";", end=";"),
        "utf-8",
    ),
    "R&S ZNB, blanks": (
        "# Version 1.00\n#\nfreq[Hz] db:Trc1_S21 ang:Trc1_S21\n" + _rows(F, DB, DEG, by="   "),
        "utf-8",
    ),
    "Smaart": (
        "TTA DM3 10-9\nFrequency (Hz)\tMagnitude (dB)\tPhase (degrees)\n" + _rows(F, DB, DEG, by="\t"),
        "utf-8",
    ),
    "Twin Builder": ('"f [kHz]", "Abs(x)[mV]","Phi(x)[rad]"\n' + _rows(F / 1e3, SIZE, RAD), "utf-8"),
    "savetxt": ("# f [Hz], real, imag\n" + CARTESIAN, "utf-8"),
    # spellings
    "kHz": ("Freq. (kHz),Re(H),Im(H)\n" + _rows(F / 1e3, H.real, H.imag), "utf-8"),
    "mHz": ("f/mHz,Re(H),Im(H)\n" + _rows(F * 1e3, H.real, H.imag), "utf-8"),
    "rad/s": ("omega (rad/s),Magnitude (mm/V),Phase [rad]\n" + _rows(2 * np.pi * F, SIZE, RAD), "utf-8"),
    "capitals": ("Frequency_Hz,Real,Imag\n" + CARTESIAN, "utf-8"),
    "wide blanks": ("Frequency (Hz)   Gain (dB)   Phase (deg)\n" + _rows(F, DB, DEG, by="  "), "utf-8"),
    "units below": ("Frequency,Gain,Phase\nHz,dB,deg\n" + POLAR, "utf-8"),
    "units below our names": ("frequency_hz,real,imag\nkHz,V/V,V/V\n" + _rows(F / 1e3, H.real, H.imag), "utf-8"),
    "more than is read": ("frequency_hz,real,imag,Gain (dB),Time\n" + _rows(F, H.real, H.imag, DB, F), "utf-8"),
    "the same twice": (
        "Frequency (Hz),Re(H),Im(H),Gain (dB),Magnitude (dB)\n" + _rows(F, H.real, H.imag, DB, DB),
        "utf-8",
    ),
    "a comment that is no header": ("# frequency_hz, imag, real\nf/Hz,Re(H),Im(H)\n" + CARTESIAN, "utf-8"),
    # signs and encodings
    "UTF-16": ("frequency_hz\treal\timag\n" + _rows(F, H.real, H.imag, by="\t"), "utf-16"),
    "cp1252": ("# Prüfstand, 20 °C\nfrequency_hz,real,imag\n" + CARTESIAN, "cp1252"),
    "latin-1": ("# \x81\xb5\nfrequency_hz,real,imag\n" + CARTESIAN, "latin-1"),
    "Excel": ("sep=;\nfrequency_hz;real;imag\n" + SEMICOLONS, "utf-8"),
    "decimal commas": (
        "frequency_hz;real;imag;day\n" + SEMICOLONS.replace(".", ",").replace("\n", ";1.5.20\n"),
        "utf-8",
    ),
    "unicode minus": ("frequency_hz,real,imag\n" + CARTESIAN.replace("-", "\u2212"), "utf-8"),
    "MATLAB complex": (
        "frequency_hz,response\n" + "".join(f"{f},{z}i\n" for f, z in zip(F, COMPLEX, strict=True)),
        "utf-8",
    ),
    "Python complex": (
        "frequency_hz;response\n" + "".join(f"{f};({z}j)\n" for f, z in zip(F, COMPLEX, strict=True)),
        "utf-8",
    ),
    "trailing separators": ("frequency_hz,real,imag,\n" + CARTESIAN.replace("\n", ",\n") + ",,,\n", "utf-8"),
    "comment column without separator": ("frequency_hz,real,imag,Comment\n" + CARTESIAN, "utf-8"),
}


def _write(tmp_path: Path, text: str, encoding: str = "utf-8", name: str = "sweep.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def _read(tmp_path: Path, text: str, **columns: str) -> FrequencyResponse:
    (test,) = read_sweeps(_write(tmp_path, text), Reading(columns))
    return test


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["LF", "CRLF", "CR"])
@pytest.mark.parametrize("kind", TEXTS)
def test_every_kind_reads_back_to_the_same_response(tmp_path: Path, kind: str, end: str) -> None:
    text, encoding = TEXTS[kind]
    (test,) = read_sweeps(_write(tmp_path, text.replace("\n", end), encoding))
    np.testing.assert_allclose(test.omega, 2 * np.pi * F, rtol=1e-14)
    np.testing.assert_allclose(test.response, H, rtol=1e-12)
    assert test.remarks == ()


def test_columns_are_named_by_the_user(tmp_path: Path) -> None:
    text = "f,Txy,real\n" + "".join(f"{f},{z}i,0\n" for f, z in zip(F, COMPLEX, strict=True))
    test = _read(tmp_path, text, f="frequency_hz", Txy="response", real="coherence")
    np.testing.assert_allclose(test.response, H, rtol=1e-12)
    np.testing.assert_array_equal(test.coherence, 0 * F)
    lag = "Stimulus no. 1 (kHz),Lag of y (rad),Level\n" + _rows(F / 1e3, RAD, SIZE)
    chosen = {"Stimulus no. 1 (kHz)": "frequency_hz", "Lag of y (rad)": "phase_rad", "Level": "magnitude"}
    test = _read(tmp_path, lag, **chosen)
    np.testing.assert_allclose(test.omega, 2 * np.pi * F, rtol=1e-12)
    np.testing.assert_allclose(test.response, H, rtol=1e-12)
    scope = "x-axis,1,2,3\nkHz,V,V,V\n" + _rows(F / 1e3, DB, H.imag, H.real)
    chosen = {"x-axis": "frequency_hz", "3": "real", "2": "imag"}
    test = _read(tmp_path, scope, **chosen)
    np.testing.assert_allclose(test.omega, 2 * np.pi * F, rtol=1e-12)
    np.testing.assert_array_equal(test.response, H)
    header = "Frequency(Hz),CH1 Amplitude(dB),CH1 Phase(Deg),CH2 Amplitude(dB),CH2 Phase(Deg)\n"
    both = header + _rows(F, DEG, DB, DB, DEG)
    chosen = {"CH2 Amplitude(dB)": "magnitude_db", "CH2 Phase(Deg)": "phase_deg"}
    np.testing.assert_allclose(_read(tmp_path, both, **chosen).response, H, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "columns", "sentence"),
    [
        (
            "Frequency,Gain,Phase (deg)\n" + POLAR,
            {},
            ", line 1: the header does not say whether 'Frequency' is frequency_hz or omega, 'Gain' is magnitude_db or "
            'magnitude; expected a unit in brackets, or for example --columns "Frequency=frequency_hz,'
            'Gain=magnitude_db"',
        ),
        (
            "Time,Input (V),Output (V)\n" + CARTESIAN,
            {"Input (V)": "input"},
            ", line 1: the header does not say whether 'Time' is time_s or another unit; expected a unit in brackets, "
            'or for example --columns "Time=time_s"',
        ),
        (
            "Setup\nFreq(Hz),S11(DB),S11(DEG),S21(DB),S21(DEG)\n" + _rows(F, DB, DEG, DB, DEG),
            {},
            ", line 2: the columns hold 2 responses (s11, s21); expected one, or for example --columns "
            '"Freq(Hz)=frequency_hz,S11(DB)=magnitude_db,S11(DEG)=phase_deg"',
        ),
        (
            "Frequency (Hz),Gain (dB),Magnitude (dB),Phase (deg)\n" + _rows(F, DB, DB, DEG),
            {},
            ", line 1: both 'Gain (dB)' and 'Magnitude (dB)' mean magnitude_db; expected one, or --columns "
            '"NAME=magnitude_db"',
        ),
        (
            "frequency_hz;real;imag\n" + SEMICOLONS.replace(".", ",").replace("1,0;", "1.0;", 1),
            {},
            f", line 2: real is '{str(H.real[0]).replace('.', ',')}'; expected a finite number with a decimal point",
        ),
        (
            "# frequency_hz, imag, real\nFrequency,Re(H),Im(H)\n" + CARTESIAN,
            {},
            ", line 2: the header does not say whether 'Frequency' is frequency_hz or omega; expected a unit in "
            'brackets, or for example --columns "Frequency=frequency_hz"',
        ),
        ("x-axis,1\nsecond,Volt\n" + _rows(F, DB), {}, f", line 1: the columns are 'x-axis', '1'; {KINDS}"),
        ("frequency_hz\x00,real,imag\n" + CARTESIAN, {}, None),
    ],
)
def test_what_a_header_leaves_open_is_refused_by_name(
    tmp_path: Path, text: str, columns: dict[str, str], sentence: str | None
) -> None:
    path = _write(tmp_path, text)
    with pytest.raises(InputError) as refusal:
        read_sweeps(path, Reading(columns))
    expected = ": character 12 is zero; expected a text file (UTF-16 with a byte order mark)"
    assert str(refusal.value) == f"{path}{expected if sentence is None else sentence}"


def test_an_unknown_name_of_ours_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"^--columns: 'hertz' is not a name of this program; expected one of coherence, "
    ):
        _read(tmp_path, "f,real,imag\n" + CARTESIAN, f="hertz")


@pytest.mark.parametrize(
    "name", ["f (mhz)", "Amplitude (Vpp)", "Phase shift", "X_Value", "#", "Peak Frequency (Hz)", ""]
)
def test_other_columns_are_none_of_ours(name: str) -> None:
    assert (found := spelt(name)) is None or found.ours is None


def test_a_line_at_0_hz_is_left_out_whatever_it_holds(tmp_path: Path) -> None:
    for line in ("0,-inf,", "0,0,0", "-0.0,nan,x"):
        test = _read(tmp_path, f"frequency_hz,magnitude_db,phase_deg\n{line}\n{POLAR}")
        np.testing.assert_allclose(test.response, H, rtol=1e-12)
        assert test.remarks == ("the line at 0 Hz was left out",)


def test_lines_in_any_order_are_sorted(tmp_path: Path) -> None:
    order = np.random.default_rng(0).permutation(F.size)
    for rows in (slice(None, None, -1), order):
        test = _read(tmp_path, "frequency_hz,real,imag\n" + _rows(F[rows], H.real[rows], H.imag[rows]))
        np.testing.assert_array_equal(test.response, H)
        assert test.remarks == ("the lines were sorted by frequency",)


def test_readings_at_one_frequency_are_averaged(tmp_path: Path) -> None:
    """The variance of a mean of n readings is 1/n of one's, and the scatter that is told is that of the readings."""
    rng = np.random.default_rng(1)
    count = np.where(F < 7, 1, 40)
    f, h = np.repeat(F, count), np.repeat(H, count)
    h = h * (1 + 0.05 * (rng.standard_normal(h.size) + 1j * rng.standard_normal(h.size)) / np.sqrt(2))
    test = _read(tmp_path, "frequency_hz,real,imag,coherence\n" + _rows(f, h.real, h.imag, 0 * f + 0.5))
    means = [h[f == each].mean() for each in F]
    np.testing.assert_allclose(test.response, means, rtol=1e-12)
    assert test.excitation is not None
    np.testing.assert_allclose(test.excitation * count, np.full(F.size, test.excitation[0]), rtol=1e-12)
    np.testing.assert_array_equal(test.coherence, 0 * F + 0.5)
    (remark,) = test.remarks
    said = "6 of 12 frequencies hold several readings, which were averaged; a single one scatters by "
    assert remark.startswith(said)
    assert float(remark.removeprefix(said).removesuffix(" %")) == pytest.approx(5, abs=0.5)


def test_a_coherence_that_is_rounded_or_unknown_rejects_nothing(tmp_path: Path) -> None:
    coherence = ["1.0000001", "nan", "NaN", "", "-1e-9", *["0.5"] * 7]
    rows = "".join(f"{row},{c}\n" for row, c in zip(CARTESIAN.splitlines(), coherence, strict=True))
    test = _read(tmp_path, "frequency_hz,real,imag,Coherence\n" + rows)
    np.testing.assert_array_equal(test.coherence, [1, np.nan, np.nan, np.nan, 0, *[0.5] * 7])


def test_the_same_measurement_counts_once(tmp_path: Path) -> None:
    """Bit for bit, however it is written; a last digit that differs is another measurement."""
    _write(tmp_path, "frequency_hz,real,imag\n" + CARTESIAN, name="a.csv")
    _write(tmp_path, "frequency_hz;real;imag\n" + SEMICOLONS.replace(".", ","), name="b.csv")
    _write(tmp_path, "frequency_hz,real,imag\n" + _rows(F, np.nextafter(H.real, 9), H.imag), name="c.csv")
    first, other = read_sweeps(tmp_path)
    assert (first.name, other.name) == ("a.csv", "c.csv")
    assert first.remarks == ("b.csv is the same measurement and was left out",)
    write_responses(tmp_path / "kept.npz", [first, other])
    assert [test.remarks for test in read_sweeps(tmp_path / "kept.npz")] == [first.remarks, ()]


@pytest.mark.parametrize("size", [1e50, 1e-50])
def test_numbers_of_any_size_are_read(tmp_path: Path, size: float) -> None:
    scaled = size * H / np.abs(H).max()
    for text in (
        "frequency_hz,real,imag\n" + _rows(F, scaled.real, scaled.imag),
        "frequency_hz,magnitude,phase_deg\n" + _rows(F, np.abs(scaled), DEG),
    ):
        np.testing.assert_allclose(_read(tmp_path, text).response, scaled, rtol=1e-12)


def test_a_lag_that_was_written_positive_is_left_to_the_fit(tmp_path: Path) -> None:
    """The inverse of a plant, which grows with frequency, is refused; the conjugate of one is not."""
    f = np.arange(0.2, 40.0, 0.2)
    plant = 7 / (2j * np.pi * f) * np.exp(-2j * np.pi * f * 0.1)
    test = _read(tmp_path, "frequency_hz,real,imag\n" + _rows(f, plant.real, -plant.imag))
    np.testing.assert_array_equal(test.response, plant.conj())
    with pytest.raises(InputError, match=r"the output leads the input by about 0\.[01]\d+ s"):
        _read(tmp_path, "frequency_hz,real,imag\n" + _rows(f, (1 / plant).real, (1 / plant).imag))
