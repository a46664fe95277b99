from icha.support import formatting


def test_sizes_have_three_digits():
    sizes = (0, 999, 1e3, 70_240, 999_700, 15_234_567, 1.5e9, 2e12)
    assert [*map(formatting.size, sizes)] == [
        *("0 B", "999 B", "1 kB", "70.2 kB", "1000 kB", "15.2 MB", "1.5 GB", "2 TB"),
    ]


def test_durations_have_two_digits():
    durations = (0.04, 9.96, 59, 119, 300, 7000, 7200, 99.7 * 3600, 450_000, 1e7)
    assert [*map(formatting.duration, durations)] == [
        *("0.04 s", "10 s", "59 s", "2 min", "5 min", "1.9 h", "2 h", "100 h", "5.2 days", "116 days"),
    ]


def test_lengths_have_the_units_of_configurations():
    lengths = (0.0, 2.5e-6, -1e-9, 0.1, 3e-15, 20.0)
    assert [*map(formatting.length, lengths)] == ["0 m", "2.5 um", "-1 nm", "100 mm", "0.003 pm", "20 m"]
