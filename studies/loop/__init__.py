"""Study of the whole loop: pieces of stock are held and identified, a lasting memory learns, and tools are chosen."""
