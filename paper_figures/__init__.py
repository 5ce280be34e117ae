"""One module a thesis figure: ``draw(results)`` is pure, ``main()`` reads, draws and saves."""
